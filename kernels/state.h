// What is kept of a shot between its stages, for each pixel of a wave; masks as 1 or 0.

// Where the shot goes to.
typedef struct {
    real wanted;           // whether the pixel takes this sample
    real x, y;             // pixels from the picture's top left corner
    real offset;           // distance squared from the pixel's middle, pixels
    real lens_x, lens_y;   // lens radii from its middle; kept with HAS_LENS or HAS_MOTION only
    real time;             // while the shutter is open; likewise
} aim;

// What was found first.
typedef struct {
    real coverage, steps;
} sighting;

// Where the pixel's rays begin: so far its block's cone is free.
typedef struct {
    real t;
} start_of_rays;

// How far the pixel's whole cone is free.
typedef struct {
    real touched, t;
} touch;

// A place on the surface, and how it looks.
typedef struct {
    real found;
    vec point;               // where it is shaded, and rays leave it
    vec seen;                // where the ray has met it
    vec normal;              // the one that stands for all: shadows, reflections, channel N
    real cone;               // the pixel's footprint there
    real smooth;             // escape count
    color tint;
#if HAS_OBJECTS || HAS_MATTES || HAS_FACES
    real object;             // the number of the object, from 1; 0: the set; -1: a light, where it is seen first; or a face's, see planes.h
#endif
#if JOINS_SMOOTHLY
    real other, share;       // where two solids flow together: the number of the other object, and its part of the colour
#endif
    real quantity;           // what chooses the colour
    real residual;           // distance of the pixel's points from their plane, in footprints
} spot;

#if HAS_OBJECTS || HAS_MATTES || HAS_FACES
#define OBJECT_OF(here) ((here).object)
#else
#define OBJECT_OF(here) R(0.0)
#endif

INLINE mask on_face(const spot *here) {
#if HAS_FACES
    return is_face(here->object);
#else
    return less(R(1.0), R(0.0));
#endif
}

#if JOINS_SMOOTHLY
#define OTHER_OF(here) ((here).other)
#define SHARE_OF(here) ((here).share)
#else
#define OTHER_OF(here) R(0.0)
#define SHARE_OF(here) R(0.0)
#endif

// One of the normals over which shading is averaged.
typedef struct {
    vec normal;
    real weight;
} facet;

// A path after a bounce.
typedef struct {
    vec origin, direction;
    real footprint, spread;
    real on_path;
    color through;   // part of what comes next that reaches the eye
    color seen;      // light so far
} path;

// What a path of light carries from a spot to the next.
typedef struct {
    color awaited;   // what a light brings, if nothing is in the way of the ray that asks for it
    real density;    // per steradian, of its direction; below 0 where lights were not asked for at all
    real total;      // what all lights weighed at the spot
#if HAS_GLASS
    real medium;        // the glass that the path is in, by the number of its body, see media.h; 0: the open
    real under;         // the glass that this one stands in likewise
    real wave;          // its place in the spectrum; below 0 while it has all colours
    color extinction;   // of the medium: what it absorbs and scatters, per unit of the way
#if HAS_GLASS_SCATTER
    color scatters;     // the part of it that is scattered
    real anisotropy;    // of that, Henyey and Greenstein's g
    real flight;        // how far the path goes until it is scattered, if nothing is nearer
    real seed_low, seed_high;   // 32 random bits for a walk of its own, as two whole numbers
#endif
#endif
} carried;

// Where a plane opens the set on the way to the next spot; its number as a thing, or 0.
typedef struct {
    real number, t, count;
    color tint;
    vec normal;
} plane_face;

#if HAS_PARTS
// What a shot knows of its layers before its end.
typedef struct {
    color albedo;     // of the first surface
    color emission;   // what the path had seen before any light was reflected ...
    color once;       // ... and before any was reflected twice
#if HAS_BUMP
    vec normal;       // by which the first surface has scattered light
#endif
} glance;
#endif

// Numbers that are kept of an aim.
#define AIM_NUMBERS (NUMBERS_OF(aim) - (HAS_LENS || HAS_MOTION ? 0 : 3))

#define STATE_AIM 0
#define STATE_SIGHTING (STATE_AIM + NUMBERS_OF(aim))
#define STATE_START (STATE_SIGHTING + NUMBERS_OF(sighting))
#define STATE_TOUCH (STATE_START + NUMBERS_OF(start_of_rays))
#define STATE_TALLY (STATE_TOUCH + NUMBERS_OF(touch))
#define STATE_PATH (STATE_TALLY + NUMBERS_OF(tally))
#define STATE_CARRIED (STATE_PATH + NUMBERS_OF(path))
#define STATE_AIR (STATE_CARRIED + (HAS_PATHS ? NUMBERS_OF(carried) : 0))
// What the formula was asked for the present spot's material.
#define STATE_ASKED(i) (STATE_AIR + (HAS_SHAFTS ? NUMBERS_OF(color) : 0) + (i))
// The same around it, and the normal and escape count there, for the slopes of its material's relief; see bump_places.h.
#define AT_SPOT (-1)
#define BUMP_PLACES 3
#define BESIDE_NUMBERS (BUMP_ASKED + (BUMP_SURFACE ? 4 : 0))
#define STATE_ASKED_BESIDE(place, i) (STATE_ASKED(ASKED) + (place) * BESIDE_NUMBERS + (i))
#define STATE_SURFACE_BESIDE(place) STATE_ASKED_BESIDE(place, BUMP_ASKED)
#define STATE_GLOW (STATE_ASKED(ASKED) + BUMP_PLACES * BESIDE_NUMBERS)
#define STATE_PARTS (STATE_GLOW + (HAS_GLOW ? NUMBERS_OF(color) : 0))
#if HAS_PARTS
#define STATE_GLANCE (STATE_PARTS + NUMBERS_OF(parts))
#define STATE_MATTES (STATE_GLANCE + NUMBERS_OF(glance))
#else
#define STATE_MATTES STATE_PARTS
#endif
#if HAS_MATTES
#define STATE_SUMS (STATE_MATTES + NUMBERS_OF(mattes))
#else
#define STATE_SUMS STATE_MATTES
#endif
// Of the first spot, and of the one after the last bounce.
#define STATE_SPOT(bounce) (STATE_SUMS + NUMBERS_OF(pixel) + ((bounce) > 0 ? NUMBERS_OF(spot) : 0))
#define STATE_FACE (STATE_SPOT(1) + NUMBERS_OF(spot))
#define STATE_LAYERS (STATE_FACE + NUMBERS_OF(plane_face))
#define STATE_FACET(i) (STATE_LAYERS + NUMBERS_OF(plane_layers) + (i) * NUMBERS_OF(facet))
// STATE_NUMBERS is what the host has made room for.
#define FEW(type) (NUMBERS_OF(type) <= MOST_NUMBERS)
typedef char structs_are_small[FEW(aim) && FEW(spot) && FEW(path) && FEW(pixel) && FEW(plane_face) && FEW(plane_layers) ? 1 : -1];
typedef char state_has_room[STATE_FACET(NORMAL_COUNT) <= STATE_NUMBERS ? 1 : -1];

#define STATE_KEEP(s, thing, number) KEEP(thing, (s).state + (number) * (s).stride, (s).stride)
#define STATE_RECALL(s, thing, number) RECALL(thing, (s).state + (number) * (s).stride, (s).stride)

INLINE aim aim_kept(__global const scalar *state, int stride) {
    aim a;
    a.lens_x = a.lens_y = a.time = R(0.0);
    numbers_recall((real *)&a, AIM_NUMBERS, state + STATE_AIM * stride, stride);
    return a;
}

INLINE spot spot_kept(__global const scalar *state, int bounce, int stride) {
    spot here;
    RECALL(here, state + STATE_SPOT(bounce) * stride, stride);
    return here;
}

INLINE void spot_keep(const spot *here, __global scalar *state, int bounce, int stride) {
    KEEP(*here, state + STATE_SPOT(bounce) * stride, stride);
}
