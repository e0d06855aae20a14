// Runs on every driver before anything else: does it compile packets of LANES lanes, and are the results right, even in
// loops whose lanes end at different times? Each work-item takes LANES points of a plane through the
// Mandelbulb of power 8 (White and Nylander's rule, polynomial form) and counts applications until it escapes; the second
// kernel calls every built-in function that the number types use, because some drivers lack a few for wide vectors; the
// third those with several ways of evaluation, in packets whose lanes need different ones (see repairs.h); the fourth iterates
// two packets side by side, in arrays and loops of a constant count as voxels.h has them, and goes on after they escaped.

__kernel void escape_counts(__global scalar *counts, int width, int limit) {
    const int first = (int)get_global_id(0) * LANES;
    scalar across[LANES];
    for (int lane = 0; lane < LANES; ++lane) across[lane] = (scalar)(first % width + lane);
    const scalar scale = S(2.5) / (scalar)width;
    const real cx = lanes_load(across) * (real)(scale) - R(1.25);
    const real cy = R(0.0) + (real)((scalar)(first / width) * scale - S(1.25));
    const real cz = R(0.3);
    real x = cx, y = cy, z = cz, count = R(0.0);
    mask alive = less_equal(x * x + y * y + z * z, R(4.0));
    for (int n = 0; n < limit; ++n) {
        if (!any_lane(alive)) break;
        // (z + i rho)^8 and (x + i y)^8 by squaring three times; rho^8 scales the latter to length rho.
        const real rho_square = x * x + y * y;
        real a = z, b = sqrt(rho_square), u = x, v = y;
        for (int squaring = 0; squaring < 3; ++squaring) {
            const real next_a = a * a - b * b, next_u = u * u - v * v;
            b = R(2.0) * a * b;
            v = R(2.0) * u * v;
            a = next_a;
            u = next_u;
        }
        const real fourth = rho_square * rho_square;
        const real shrink = pick(less(R(0.0), fourth), b / (fourth * fourth), R(0.0));
        const real next_x = u * shrink + cx, next_y = v * shrink + cy, next_z = a + cz;
        x = pick(alive, next_x, x);
        y = pick(alive, next_y, y);
        z = pick(alive, next_z, z);
        count = pick(alive, (real)((scalar)(n + 1)), count);
        alive &= less_equal(x * x + y * y + z * z, R(4.0));
    }
    lanes_store(count, counts + first);
}

__kernel void built_ins(__global scalar *sums, __global const scalar *arguments) {
    const int first = (int)get_global_id(0) * LANES;
    const real t = lanes_load(arguments + first);  // between 0 and 1
    real sum = sqrt(t) + exp(t) + log(t + R(0.5)) + exp2(t) + log2(t + R(0.5)) + sin(t) + cos(t) + tan(t);
    sum += asin(t) + acos(t) + atan(t) + atan2(t, R(0.7)) + pow(t + R(0.5), R(1.7)) + floor(t * R(8.0)) + fabs(t - R(0.5));
    sum += fmin(t, R(0.4)) + fmax(t, R(0.6)) + clamp(t, R(0.3), R(0.7));
    sum += pick(less(t, R(0.5)), R(1.0), R(2.0)) + pick(equal(t, t) & ~is_nan(t), R(4.0), R(8.0));
    lanes_store(sum, sums + first);
}

__kernel void mixed_lanes(__global scalar *values, __global const scalar *arguments, int count) {
    const int first = (int)get_global_id(0) * LANES;
    const real t = lanes_load(arguments + first);
    const real results[4] = {sin(t), cos(t), pow(fabs(t), R(1.7)), log(fabs(t))};
    for (int function = 0; function < 4; ++function) lanes_store(results[function], values + function * count + first);
}

typedef struct {
    real x, y;
} probe_state;

INLINE probe_state probe_apply(probe_state z, probe_state c) {
    return (probe_state){z.x * z.x - z.y * z.y + c.x, R(2.0) * z.x * z.y + c.y};
}

// Whether points of the plane of the Mandelbrot set are still within |z| <= 2 after `limit` applications, a multiple of 4.
__kernel void side_by_side(__global scalar *inside, int width, int limit) {
    const scalar scale = S(3.0) / (scalar)width;
    const int first = (int)get_global_id(0) * 2 * LANES;
    probe_state c[2], z[2];
    mask alive[2], open = equal(R(0.0), R(0.0));
    for (int p = 0; p < TURNS(2); ++p) {
        scalar across[LANES];
        for (int lane = 0; lane < LANES; ++lane) across[lane] = (scalar)((first + p * LANES + lane) % width) * scale - S(2.25);
        c[p].x = lanes_load(across);
        c[p].y = (real)((scalar)(first / width) * scale - S(1.25));
        z[p] = c[p];
        alive[p] = less_equal(z[p].x * z[p].x + z[p].y * z[p].y, R(4.0));
    }
    for (int n = 0; n + 4 <= limit && any_lane(open); n += 4) {
        for (int step = 0; step < TURNS(4); ++step) {
            for (int p = 0; p < TURNS(2); ++p) {
                z[p] = probe_apply(z[p], c[p]);
                alive[p] &= less_equal(z[p].x * z[p].x + z[p].y * z[p].y, R(4.0));
            }
        }
        open = alive[0] | alive[1];
    }
    for (int p = 0; p < TURNS(2); ++p) lanes_store(pick(alive[p], R(1.0), R(0.0)), inside + first + p * LANES);
}
