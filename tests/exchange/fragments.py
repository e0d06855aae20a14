"""Small fragments of our own in FragM's format, and what each of them means, in NumPy by hand."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]

VIEW = """FOV = 0.5
Eye = 1,-6,2
Target = 0,1,0.5
Up = 0,0.2,1
"""
HEAD = '#info A test\n#include "MathUtils.frag"\n#include "DE-Raytracer.frag"\n#group Test\n'


def fragment(code: str, preset: str = "", head: str = HEAD) -> str:
    """The text of a fragment with a preset."""
    return f"{head}{code}\n#preset Default\n{VIEW}{preset}\n#endpreset\n"


@dataclass(frozen=True)
class Meaning:
    """A fragment, and its distance at points of shape (n, 3), by hand."""

    text: str
    distance: Callable[[Float], Float]
    reach: float = 2.0


def _turn(axis: Float, degrees: float) -> Float:
    """The matrix that turns columns about an axis (Rodrigues)."""
    k = axis / np.linalg.norm(axis)
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    cross = np.array([[0, -k[2], k[1]], [k[2], 0, -k[0]], [-k[1], k[0], 0]])
    return np.asarray(c * np.eye(3) + s * cross + (1 - c) * np.outer(k, k))


# --- no loop

BALL = fragment("""
uniform float Radius; slider[0.1,1.0,2.0]
uniform vec3 Middle; slider[(-1,-1,-1),(0.2,0.1,-0.3),(1,1,1)]
float tube(vec2 p) { return length(p) - 0.3; }
float DE(vec3 pos) {
	float d = length(pos - Middle) - Radius;
	if (pos.z > 0.5) return d + 0.1;
	d = max(d, -tube(pos.xy)); // without a tube
	return min(d, length(pos.yz - vec2(1.0, 0.5)) - 0.2);
}""")


def _ball(p: Float) -> Float:
    d = np.linalg.norm(p - [0.2, 0.1, -0.3], axis=1) - 1
    cut = np.maximum(d, 0.3 - np.hypot(p[:, 0], p[:, 1]))
    low = np.minimum(cut, np.hypot(p[:, 1] - 1, p[:, 2] - 0.5) - 0.2)
    return np.asarray(np.where(p[:, 2] > 0.5, d + 0.1, low))


# --- a box that is folded: a running derivative beside z, and an end that z itself does not tell

BOX = fragment(
    """
#define providesInit
uniform int Iterations; slider[0,12,100]
uniform int ColorIterations; slider[0,3,100]
uniform float Scale; slider[-3,2,4]
uniform float MinRad2; slider[0,0.25,2]
uniform vec3 Axis; slider[(0,0,0),(1,1,0.5),(1,1,1)]
uniform float Angle; slider[0,20,180]
vec4 factors = vec4(Scale, Scale, Scale, abs(Scale)) / MinRad2;
mat3 turned;
void init() { turned = rotationMatrix3(normalize(Axis), Angle); }
float less = abs(Scale - 1.0), last = pow(abs(Scale), float(1 - Iterations));
float DE(vec3 pos) {
	vec4 p = vec4(pos, 1), first = p; // p.w is the derivative
	for (int i = 0; i < Iterations; i++) {
		p.xyz *= turned;
		p.xyz = clamp(p.xyz, -1.0, 1.0) * 2.0 - p.xyz;
		float r2 = dot(p.xyz, p.xyz);
		if (i < ColorIterations) orbitTrap = min(orbitTrap, abs(vec4(p.xyz, r2)));
		p *= clamp(max(MinRad2 / r2, MinRad2), 0.0, 1.0);
		p = p * factors + first;
		if (r2 > 50.0) break;
	}
	return (length(p.xyz) - less) / p.w - last;
}""",
    "Iterations = 8\nScale = 2.3\nMinRad2 = 0.3\nAngle = 25",
)


def _box(points: Float) -> Float:
    matrix, scale, least = _turn(np.array([1, 1, 0.5]), 25), 2.3, 0.3
    found = []
    for pos in points:
        z, w = pos.copy(), 1.0
        for _ in range(8):
            z = matrix @ z  # a row times the transposed matrix, as MathUtils has it
            z = 2 * np.clip(z, -1, 1) - z
            r2 = z @ z
            k = min(max(least / r2, least), 1.0)
            z, w = z * k * scale / least + pos, w * k * scale / least + 1
            if r2 > 50:
                break
        found.append((np.linalg.norm(z) - abs(scale - 1)) / w - scale ** (1 - 8))
    return np.array(found)


# --- a sponge by folds: `while`, exchanged components, and a count that is asked for behind

SPONGE = fragment("""
uniform int Iterations; slider[0,5,20]
uniform float Scale; slider[1,3,4]
uniform vec3 Offset; slider[(0,0,0),(1,0.9,0.8),(1,1,1)]
float DE(vec3 z) {
	int n = 0;
	while (n < Iterations && dot(z, z) < 900.0) {
		z = abs(z);
		if (z.x < z.y) { z.xy = z.yx; }
		if (z.x < z.z) z.xz = z.zx;
		if (z.y < z.z) z.yz = z.zy;
		z = Scale * z - Offset * (Scale - 1.0);
		if (z.z < -0.5 * Offset.z * (Scale - 1.0)) z.z += Offset.z * (Scale - 1.0);
		n++;
	}
	return abs(length(z) - 1.5) * pow(Scale, float(-n));
}""")


def _sponge(points: Float) -> Float:
    found = []
    offset = np.array([1, 0.9, 0.8])
    for pos in points:
        z, n = pos.copy(), 0
        while n < 5 and z @ z < 900:
            z = 3 * np.sort(np.abs(z))[::-1] - 2 * offset
            if z[2] < -offset[2]:
                z[2] += 2 * offset[2]
            n += 1
        found.append(abs(np.linalg.norm(z) - 1.5) * 3.0**-n)
    return np.array(found)


# --- a bulb: functions with `inout`, a Julia set by a switch, a bailout, and a power that a parameter says

BULB = fragment(
    """
uniform int Iterations; slider[0,9,100]
uniform float Power; slider[2,8,16]
uniform float Bailout; slider[1,4,30]
uniform bool Julia; checkbox[false]
uniform vec3 JuliaC; slider[(-2,-2,-2),(0.3,0.2,0.1),(2,2,2)]
void grow(inout vec3 z, in float r, inout float dr) {
	float theta = acos(z.z / r) * Power, phi = atan(z.y, z.x) * Power;
	dr = pow(r, Power - 1.0) * Power * dr + 1.0;
	z = pow(r, Power) * vec3(sin(theta) * cos(phi), sin(phi) * sin(theta), cos(theta));
}
float DE(vec3 pos) {
	vec3 z = pos;
	float dr = 1.0, r = length(z);
	int i = 0;
	while (r < Bailout && i < Iterations) {
		grow(z, r, dr);
		z += (Julia ? JuliaC : pos);
		r = length(z);
		i++;
	}
	return 0.5 * log(r) * r / dr;
}""",
    "Iterations = 6\nPower = 8",
)


def _bulb(points: Float, added: Float | None = None) -> Float:
    found = []
    for pos in points:
        z, dr, r = pos.copy(), 1.0, float(np.linalg.norm(pos))
        for _ in range(6):
            if r >= 4:
                break
            theta, phi = 8 * np.arccos(z[2] / r), 8 * np.arctan2(z[1], z[0])
            dr = r**7 * 8 * dr + 1
            z = r**8 * np.array([np.sin(theta) * np.cos(phi), np.sin(phi) * np.sin(theta), np.cos(theta)])
            z = z + (pos if added is None else added)
            r = float(np.linalg.norm(z))
        found.append(0.5 * np.log(r) * r / dr if r >= 4 else 0.0)
    return np.array(found)


# --- a Julia set of quaternions: four numbers, with a derivative of four

QUATERNION = fragment("""
uniform int Iterations; slider[0,7,100]
uniform float Threshold; slider[0,16,100]
uniform vec4 C; slider[(-1,-1,-1,-1),(-0.2,0.6,0.2,0.1),(1,1,1,1)]
float DE(vec3 pos) {
	vec4 p = vec4(pos, 0.1), dp = vec4(1.0, 0.0, 0.0, 0.0);
	for (int i = 0; i < Iterations; i++) {
		dp = 2.0 * vec4(p.x * dp.x - dot(p.yzw, dp.yzw), p.x * dp.yzw + dp.x * p.yzw + cross(p.yzw, dp.yzw));
		p = vec4(p.x * p.x - dot(p.yzw, p.yzw), vec3(2.0 * p.x * p.yzw)) + C;
		if (dot(p, p) > Threshold) break;
	}
	float r = length(p);
	return 0.5 * r * log(r) / length(dp);
}""")


def _quaternion(points: Float) -> Float:
    def times(a: Float, b: Float) -> Float:
        v = a[0] * b[1:] + b[0] * a[1:] + np.cross(a[1:], b[1:])
        return np.array([a[0] * b[0] - a[1:] @ b[1:], *v])

    found = []
    for pos in points:
        p, dp, out = np.array([*pos, 0.1]), np.array([1.0, 0, 0, 0]), False
        for _ in range(7):
            dp = 2 * times(p, dp)
            p = np.add(times(p, p), [-0.2, 0.6, 0.2, 0.1])
            out = p @ p > 16
            if out:
                break
        r = np.linalg.norm(p)
        found.append(0.5 * r * np.log(r) / np.linalg.norm(dp) if out else 0.0)
    return np.array(found)


# --- cubes cut out of a cube: nothing but distances and a factor are carried

CUBES = fragment("""
uniform int Iterations; slider[0,4,10]
float DE(vec3 p) {
	p = p * 0.5 + vec3(0.5);
	vec3 q = abs(p - 0.5) - 0.5;
	float k = 1.0, d = max(q.x, max(q.y, q.z));
	for (int i = 0; i < Iterations; i++) {
		vec3 a = mod(3.0 * p * k, 3.0);
		k *= 3.0;
		q = 0.5 - abs(a - 1.5);
		d = max(d, min(max(q.x, q.z), min(max(q.x, q.y), max(q.y, q.z))) / k);
	}
	return d;
}""")


def _cubes(points: Float) -> Float:
    p = points * 0.5 + 0.5
    d, k = (np.abs(p - 0.5) - 0.5).max(axis=1), 1.0
    for _ in range(4):
        a = np.mod(3 * p * k, 3.0)
        k *= 3
        q = np.sort(0.5 - np.abs(a - 1.5), axis=1)
        d = np.maximum(d, q[:, 1] / k)  # the second largest of pairs' largest is the middle one
    return np.asarray(d)


# --- a loop within the loop, one behind it, `continue`, an array, and a return out of the loop

LOOPS = fragment(
    """
const int many = 2;
uniform int Iterations; slider[0,6,20]
uniform int Folds; slider[1,2,5]
float around(vec3 p) {
	float d[2];
	for (int j = 0; j < many; j++) { d[j] = length(p - vec3(float(j), 0.0, 0.0)) - 0.3; }
	return min(d[0], d[1]);
}
float DE(vec3 z) {
	float s = 1.0;
	for (int i = 0; i < Iterations; ++i) {
		for (int j = 0; j < Folds; j++) {
			z = abs(z) - 0.4;
			if (z.x > z.y) continue;
			z.xyz = z.yxz;
		}
		z *= 1.7; s *= 1.7;
		if (z.z > 3.0) return length(z) / s;
	}
	return around(z) / s;
}""".replace("float sizes[2] = float[2](0.5, 0.25);\n", ""),
)


def _loops(points: Float) -> Float:
    found = []
    for pos in points:
        z, s, result = pos.copy(), 1.0, None
        for _ in range(6):
            for _ in range(2):
                z = np.abs(z) - 0.4
                if not z[0] > z[1]:
                    z = z[[1, 0, 2]]
            z, s = z * 1.7, s * 1.7
            if z[2] > 3:
                result = np.linalg.norm(z) / s
                break
        near = min(np.linalg.norm(z - [j, 0, 0]) - 0.3 for j in (0, 1))
        found.append(near / s if result is None else result)
    return np.array(found)


MEANINGS = {
    "ball": Meaning(BALL, _ball),
    "box": Meaning(BOX, _box, 4.0),
    "sponge": Meaning(SPONGE, _sponge, 1.5),
    "bulb": Meaning(BULB, _bulb, 1.3),
    "quaternion": Meaning(QUATERNION, _quaternion, 1.3),
    "cubes": Meaning(CUBES, _cubes, 1.2),
    "loops": Meaning(LOOPS, _loops, 1.5),
}
julia_bulb = _bulb
