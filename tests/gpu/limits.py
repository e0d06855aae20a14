"""What OpenCL 1.2 guarantees of every device, and what compilers of GPUs are known to lack, looked for in programs.

Guaranteed are (The OpenCL Specification 1.2, table 4.3, full profile) 8 constant arguments of 64 KB each, 1024 bytes of
arguments and 32 KB of local memory. Nothing is guaranteed of work-groups' sizes: `clfractal.device.groups` asks the device.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from graphlib import CycleError, TopologicalSorter

CONSTANT_ARGUMENTS = 8
CONSTANT_BYTES = 64 * 1024
ARGUMENT_BYTES = 1024
LOCAL_BYTES = 32 * 1024

# Words that no preprocessed text for one lane has, and why not. What clang rejects as OpenCL 1.2 without extensions is not
# among them (`tests/platforms/test_compilers.py`): double constants, arrays of variable length, pointers to functions.
LACKING = {
    r"printf": "it costs a buffer, and drivers of AMD and Apple lose what it prints",
    r"goto": "compilers for GPUs need structured control flow, and some give up",
    r"(?:u?char|u?short|u?int|u?long|float|double)3|v(?:load|store)3": "drivers differ in the size of three",
    r"v(?:load|store)a?_half\w*|half\d*": "numbers of 16 bits are an extension",
    r"(?:work|sub)_group_\w+|enqueue_kernel|pipe|__?generic": "they came with OpenCL 2.0",
    r"atom_\w+": "atomics of 64 bits are an extension",
    r"(?:read_|write_)?mem_fence|barrier": "work-items without work end at once, and all of a group must reach a barrier",
    r"__builtin_\w+": "only clang has them",
    r"asm|__asm__": "one maker's instructions",
    r"(?:__)?(?:constant|global|local)\b[^(),;{}*]*\w\[\w*\]\s*(?=[,)])": "Apple's compiler takes pointers, not arrays",
}
# A program that is given an image is chosen where the device has images.
_IMAGES = (r"image\w+_t|(?:read|write)_image\w*", "a device may have no images")
_GIVEN_IMAGE = re.compile(r"__kernel void \w+\([^{]*\bimage2d_t\b")


def words(text: str, preprocessed: str) -> Iterator[str]:
    """Words that devices may lack, each with the reason, in a program's text as it is and after the preprocessor."""
    lacking = LACKING if _GIVEN_IMAGE.search(text) else {**LACKING, _IMAGES[0]: _IMAGES[1]}
    for pattern, reason in lacking.items():
        for word in sorted(set(re.findall(rf"\b(?:{pattern})(?!\w)", preprocessed))):
            yield f"{word}: {reason}"


@dataclass(frozen=True, slots=True)
class Entry:
    """A kernel's arguments: how many bytes they take, and how many are pointers to constant memory."""

    name: str
    constant: int
    bytes: int
    structs: int


_ENTRY = re.compile(r"\.entry (\w+)\(([^)]*)\)")
_FUNCTION = re.compile(r"\.func\s+(?:\([^)]*\)\s*)?(\w+)\s*\([^)]*\)\s*\{.*?^\}", re.MULTILINE | re.DOTALL)
_CALL = re.compile(r"\bcall(?:\.uni)?\s*(?:\([^)]*\),)?\s*(\w+)")
_VARIABLE = re.compile(
    r"^\s*(?:\.visible |\.extern )?\.(const|shared) [^\n]*?\.[bfsu](\d+) \w+(?:\[(\d+)\])?", re.MULTILINE
)


def entries(ptx: str) -> Iterator[Entry]:
    """The kernels of a program in NVIDIA's assembly."""
    for name, arguments in _ENTRY.findall(ptx):
        each = [line for line in arguments.split(",") if line.strip()]
        sizes = [_size_of(line) for line in each]
        structs = sum("[" in line for line in each)
        yield Entry(name, sum(".ptr .const" in line for line in each), sum(sizes), structs)


def _size_of(argument: str) -> int:
    bits = re.search(r"\.[bfsu](\d+)\b", argument)
    count = re.search(r"\[(\d+)\]", argument)
    assert bits, argument
    return int(bits[1]) // 8 * (int(count[1]) if count else 1)


def broken(ptx: str) -> Iterator[str]:
    """Which guarantees of OpenCL 1.2 a program does not keep to, and whether it is recursive."""
    for entry in entries(ptx):
        if entry.constant > CONSTANT_ARGUMENTS:
            yield f"{entry.name} has {entry.constant} constant arguments, {CONSTANT_ARGUMENTS} are guaranteed"
        if entry.bytes > ARGUMENT_BYTES:
            yield f"{entry.name} has {entry.bytes} bytes of arguments, {ARGUMENT_BYTES} are guaranteed"
        if entry.structs:
            yield f"{entry.name} has vectors or structs as arguments, whose layouts differ between drivers"
    limits = {"const": CONSTANT_BYTES, "shared": LOCAL_BYTES}
    used = dict.fromkeys(limits, 0)
    for space, bits, count in _VARIABLE.findall(ptx):
        used[space] += int(bits) // 8 * int(count or 1)
    for space, limit in limits.items():
        if used[space] > limit:
            yield f"{used[space]} bytes of .{space} memory, {limit} are guaranteed"
    if "cvta.const" in ptx:
        yield "a constant pointer becomes one to any memory, which older drivers of NVIDIA refuse"
    calls = {match[1]: set(_CALL.findall(match[0])) for match in _FUNCTION.finditer(ptx)}
    try:
        TopologicalSorter(calls).prepare()
    except CycleError as cycle:
        yield f"recursion, which OpenCL forbids: {' -> '.join(cycle.args[1])}"
