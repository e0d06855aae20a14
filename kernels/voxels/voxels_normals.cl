// Normals of the samples that a ray meets the surface between, from the formula itself. One work-item takes a brick.
#include "formulas/orbits.h"
#include "integrators/march/normals.h"
#include "voxels/voxels.h"

// How far from a sample the surface is looked for, to each side, and the tests that narrow it down: in sides of a voxel. A
// cell's diagonal is 1.7 of them.
#define SEARCH S(2.0)
#define SEARCH_STEPS 4
#define HALVINGS 8
// Lines through a voxel along -G, and how far they are apart.
#define LINES 9
#define LINE_STEP S(0.4)

#define SAMPLES_AT_A_TIME (LANES * PACKETS)

// Whether a sample belongs to a cell of the brick with samples inside and outside: some neighbour in its cells is on the other
// side. Without a direction for the search nothing can be found.
INLINE bool wanted_sample(__global const uint *normals, int sample) {
    const uint own = normals[sample];
    if ((own & 0xffffff) == 0x808080) return false;
    const int x = sample % BRICK_SIDE, y = sample / BRICK_SIDE % BRICK_SIDE, z = sample / (BRICK_SIDE * BRICK_SIDE);
    const int left = max(x - 1, 0), right = min(x + 1, BRICK_SIDE - 1), below = max(y - 1, 0), above = min(y + 1, BRICK_SIDE - 1);
    uint differ = 0;
    for (int k = max(z - 1, 0); k <= min(z + 1, BRICK_SIDE - 1); ++k) {
        for (int j = below; j <= above; ++j) {
            __global const uint *row = normals + BRICK_SIDE * (BRICK_SIDE * k + j);
            differ |= (row[left] ^ own) | (row[x] ^ own) | (row[right] ^ own);
        }
    }
    return differ >> 31 != 0;
}

// A direction in three bytes, by the length from SHORTEST to 1 whose rounded components keep it best (Kaplanyan 2010, "CryENGINE 3:
// Reaching the speed of light"). With length 1 they are off by 0.17 degrees in the median, so by 0.06. What is blended with others of its
// cell must not be much shorter than these.
#define SHORTEST 0.9f
#define LENGTHS 16

INLINE uint packed(float x, float y, float z) {
    uint best = 0;
    float least = MAXFLOAT;
    for (int i = 0; i < TURNS(LENGTHS); ++i) {
        const float length = 127.5f * (1.0f - (1.0f - SHORTEST) / LENGTHS * (float)i);
        const uint red = convert_uchar_sat(x * length + 128.0f), green = convert_uchar_sat(y * length + 128.0f);
        const uint blue = convert_uchar_sat(z * length + 128.0f);
        const float u = (float)red - 127.5f, v = (float)green - 127.5f, w = (float)blue - 127.5f;
        const float a = y * w - z * v, b = z * u - x * w, c = x * v - y * u;
        const float off = (a * a + b * b + c * c) / (u * u + v * v + w * w);
        if (off < least) {
            least = off;
            best = red | green << 8 | blue << 16;
        }
    }
    return best;
}

// Lines of PACKETS packets, one a lane: through `from`, along `out`, which points out of the solid.
typedef struct {
    vec from[PACKETS], out[PACKETS];
} lines;

// The places along lines, in scene units from their middles, where they go from inside to outside: the outer end of a
// bracket that is narrowed down. Not found: none, or not within reach.
INLINE void find_surface(const lines *l, real side, real *place, mask *found, orbit_record orbit, constants k) {
    real inner[PACKETS], outer[PACKETS];
    mask before[PACKETS], here[PACKETS];
    vec points[PACKETS];
    const real step = side * R(2.0) * (real)(SEARCH) / (real)((scalar)SEARCH_STEPS);
    for (int p = 0; p < TURNS(PACKETS); ++p) {
        found[p] = less(R(1.0), R(0.0));
        before[p] = found[p];
        inner[p] = outer[p] = R(0.0);
    }
    // Of several places the nearest to the middle.
    for (int i = 0; i < TURNS(SEARCH_STEPS + 1); ++i) {
        const real at = (real)((scalar)i) * step - side * (real)(SEARCH);
        for (int p = 0; p < TURNS(PACKETS); ++p) points[p] = vec_along(l->from[p], at, l->out[p]);
        solid_inside(points, here, orbit, k);
        for (int p = 0; p < TURNS(PACKETS); ++p) {
            const mask crossed = before[p] & ~here[p];
            const real middle = at - R(0.5) * step;
            const mask nearer = crossed & (~found[p] | less(fabs(middle), fabs(R(0.5) * (inner[p] + outer[p]))));
            inner[p] = pick(nearer, at - step, inner[p]);
            outer[p] = pick(nearer, at, outer[p]);
            found[p] |= crossed;
            before[p] = here[p];
        }
    }
    for (int i = 0; i < TURNS(HALVINGS); ++i) {
        for (int p = 0; p < TURNS(PACKETS); ++p) {
            points[p] = vec_along(l->from[p], R(0.5) * (inner[p] + outer[p]), l->out[p]);
        }
        solid_inside(points, here, orbit, k);
        for (int p = 0; p < TURNS(PACKETS); ++p) {
            const real middle = R(0.5) * (inner[p] + outer[p]);
            inner[p] = pick(here[p], middle, inner[p]);
            outer[p] = pick(here[p], outer[p], middle);
        }
    }
    for (int p = 0; p < TURNS(PACKETS); ++p) place[p] = outer[p];
}

// From the Jacobian just outside the surface, or Eq. 7-10: the plane through points of the surface on lines along -G, in a frame with that
// as its third axis, so that steep faces work.
INLINE void surface_normals(const lines *l, int exact, real side, vec *normal, mask *usable, orbit_record orbit, constants k) {
    vec across[PACKETS], up[PACKETS];
    plane_sums sums[PACKETS];
    real place[PACKETS];
    lines line = *l;
    for (int p = 0; p < TURNS(PACKETS); ++p) {
        const vec n = l->out[p];
        const mask steep = less(fabs(n.x), R(0.6));
        const vec aside = vec_pick(steep, vec_of(R(1.0), R(0.0), R(0.0)), vec_of(R(0.0), R(1.0), R(0.0)));
        across[p] = vec_normalize(vec_cross(aside, n));
        up[p] = vec_cross(n, across[p]);
        sums[p] = plane_none();
    }
    const int middle = LINES / 2, last = exact ? middle + 1 : LINES;
    #pragma unroll 1
    for (int i = exact ? middle : 0; i < last; ++i) {
        const real x = side * (real)(LINE_STEP) * (real)((scalar)(i % 3 - 1));
        const real y = side * (real)(LINE_STEP) * (real)((scalar)(i / 3 - 1));
        for (int p = 0; p < TURNS(PACKETS); ++p) line.from[p] = vec_along(vec_along(l->from[p], x, across[p]), y, up[p]);
        find_surface(&line, side, place, usable, orbit, k);
        for (int p = 0; p < TURNS(PACKETS); ++p) sums[p] = plane_add(sums[p], usable[p], vec_of(x, y, place[p]));
    }
    for (int p = 0; p < TURNS(PACKETS); ++p) {
        if (exact) {
            surface_point surface;
            orbit_dual_distance(vec_along(l->from[p], place[p], l->out[p]), usable[p], OF_SURFACE, orbit, k, &surface);
            normal[p] = vec_normalize(surface.gradient);
            usable[p] &= less(R(0.5), vec_dot(normal[p], normal[p]));
        } else {
            real residual;
            const vec plane = normal_of_plane(sums[p], &residual, &usable[p]);
            normal[p] = vec_along(vec_along(vec_scale(l->out[p], plane.z), plane.x, across[p]), plane.y, up[p]);
        }
    }
}

// Normals of the bricks from `first` on, in slots from `slot` on: those by differences are where the search begins, and stay
// where it finds nothing.
__kernel void refine_normals(__global uint *normals, __global const ulong *bricks, int first, int count, int slot,
                             __global const scalar *axes, __constant const struct Lattice *lattice,
                             orbit_record orbit, constants k) {
    const int brick = first + (int)get_global_id(1);
    if (brick >= count) return;
    __global uint *normal = normals + (size_t)(slot + brick) * BRICK_STRIDE;
    const ulong place = bricks[brick];
    const real side = (real)(lattice->side);
    for (int next = 0;;) {
        ushort list[SAMPLES_AT_A_TIME];
        int wanted = 0;
        for (; next < BRICK_SAMPLES && wanted < SAMPLES_AT_A_TIME; ++next) {
            if (wanted_sample(normal, next)) list[wanted++] = (ushort)next;
        }
        if (wanted == 0) break;
        lines l;
        for (int p = 0; p < TURNS(PACKETS); ++p) {
            scalar from[3][LANES], out[3][LANES];
            for (int lane = 0; lane < LANES; ++lane) {
                // The last lanes repeat the last sample.
                const int sample = list[min(p * LANES + lane, wanted - 1)];
                const int voxel[3] = {BRICK * PLACE_X(place) + sample % BRICK_SIDE,
                                      BRICK * PLACE_Y(place) + sample / BRICK_SIDE % BRICK_SIDE,
                                      BRICK * PLACE_Z(place) + sample / (BRICK_SIDE * BRICK_SIDE)};
                __global const scalar *along = axes;
                for (int axis = 0; axis < 3; ++axis) {
                    from[axis][lane] = lattice->middle_offset[axis] + along[min(voxel[axis], lattice->last[axis])];
                    out[axis][lane] = (scalar)((normal[sample] >> (8 * axis)) & 255) - S(127.5);
                    along += lattice->sub_points * lattice->padded[axis];
                }
            }
            l.from[p] = vec_load(from);
            l.out[p] = vec_normalize(vec_load(out));
        }
        vec found[PACKETS];
        mask usable[PACKETS];
        surface_normals(&l, lattice->exact_normals, side, found, usable, orbit, k);
        for (int p = 0; p < TURNS(PACKETS); ++p) {
            scalar n[3][LANES], good[LANES];
            vec_store(found[p], n);
            lanes_store(pick(usable[p], R(1.0), R(0.0)), good);
            for (int lane = 0; lane < LANES; ++lane) {
                const int at = p * LANES + lane;
                if (at >= wanted || good[lane] == 0) continue;
                const int sample = list[at];
                normal[sample] = packed((float)n[0][lane], (float)n[1][lane], (float)n[2][lane]) | (normal[sample] & 0xff000000u);
            }
        }
    }
}
