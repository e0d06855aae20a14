// Unbiased ways through a medium whose density differs from place to place, by a bound of its extinction in each brick: delta tracking
// (Woodcock et al. 1965) finds where light is scattered, ratio tracking (Novak et al. 2014) what comes through.
//
// Lengths are numbers of a grid_ray, which here count sides of a voxel, as extinction does.
#define MOST_FLIGHTS 1000000    // that may end within one ray

// What a ray meets, told by `volume_bounds.h` of a grid in bricks and by `clouds.h` of an object: the bound of extinction at a place and
// the number past it where that ends; the value there, if there is one; its extinction; whether light is added on the way, and which.
INLINE real bound_at(grid_ray r, real number, mask active, world w, real *until);
INLINE mask value_met(grid_ray r, real number, mask active, world w, real *value);
INLINE real extinction_at(grid_ray r, real value, world w);
INLINE int shines_itself(world w);
INLINE color emission_of(real value, world w);

// Random numbers of a lane, as many as it needs, whatever the others need.
typedef struct {
    bits seed, stride;
    ints count;
} stream;

INLINE stream stream_of(const packet_pixels *at, uint seed, uint purpose, int sample) {
    const bits own = hash_bits(pixel_seed(at->columns, at->rows, seed, purpose) + (bits)((uint)sample) * 0x9e3779b9u);
    return (stream){own, hash_bits(own ^ 0x68bc21ebu) | 1u, to_ints(R(0.0))};
}

// The next number of the active lanes, strictly within (0, 1).
INLINE real stream_next(stream *s, mask active) {
    int counts[LANES];
    ints_store(s->count, counts);
    s->count -= active;
    return unit_of_bits(hash_bits(hash_bits(s->seed + bits_load(counts) * s->stride) + s->stride));
}

// The next place at which the medium might do something, before `far`; lanes that reach `far` are no longer `active`. Past a brick's
// side a flight begins anew, as it has no memory.
INLINE mask flight(grid_ray r, stream *random, real *number, real far, mask *active, world w, real *bound, real *looked) {
    real until;
    *bound = bound_at(r, *number, *active, w, &until);
    *looked += pick(*active, R(1.0), R(0.0));
    const real u = stream_next(random, *active);
    const mask some = less(R(0.0), *bound);
    const real ends = *number - log(u) / pick(some, *bound, R(1.0));
    const mask tries = *active & some & less(ends, until) & less(ends, far);
    *number = pick(*active, pick(tries, ends, until), *number);
    *active &= less(*number, far);
    return tries;
}

// Finds where a ray is scattered or absorbed; `shines`: the light that the medium adds on the way.
INLINE mask track(grid_ray r, real far, mask active, stream *random, world w, real *number, real *value, color *shines, real *looked) {
    mask met = active & ~active;
    *number = R(0.0);
    *value = R(0.0);
    for (int i = 0; i < MOST_FLIGHTS; ++i) {
        if (!any_lane(active)) break;
        real bound;
        const mask tries = flight(r, random, number, far, &active, w, &bound, looked);
        if (!any_lane(tries)) continue;
        real here;
        const mask stored = value_met(r, *number, tries, w, &here);
        const real chance = pick(stored, extinction_at(r, here, w), R(0.0));
        // One over the bound is how far apart, in the mean, such places are.
        if (shines_itself(w)) *shines = color_pick(stored, color_add(*shines, color_scale(emission_of(here, w), R(1.0) / bound)), *shines);
        const mask real_one = tries & less(stream_next(random, tries) * bound, chance);
        *value = pick(real_one, here, *value);
        met |= real_one;
        active &= ~real_one;
    }
    return met;
}

// The part of light that comes through up to `far`, in the mean.
INLINE real track_through(grid_ray r, real far, mask active, stream *random, world w, real *looked) {
    real number = R(0.0), through = R(1.0);
    for (int i = 0; i < MOST_FLIGHTS; ++i) {
        if (!any_lane(active)) break;
        real bound, here;
        const mask tries = flight(r, random, &number, far, &active, w, &bound, looked);
        if (!any_lane(tries)) continue;
        const mask stored = value_met(r, number, tries, w, &here);
        const real left = fmax(R(1.0) - extinction_at(r, here, w) / pick(tries, bound, R(1.0)), R(0.0));
        through = pick(stored, through * left, through);
        // Russian roulette, which keeps the mean.
        const mask faint = tries & less(through, R(0.1));
        const mask stays = less(stream_next(random, faint) * R(0.1), through);
        through = pick(faint, pick(stays, R(0.1), R(0.0)), through);
        active &= less(R(0.0), through);
    }
    return through;
}
