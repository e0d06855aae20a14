// What a place in a medium does to light, as events.h has it.

typedef struct {
    vec before;        // the way of the light that arrives, from the eye
    real anisotropy;   // Henyey and Greenstein's g
} medium_event;

// Where an event sends a path on.
typedef struct {
    vec direction;
    real density;   // per steradian, of choosing it
    color part;     // what the path keeps: the value over the density
    mask goes;      // whether there is such a direction ...
    mask sinks;     // ... and whether it goes below a boundary
} onward;

// What is scattered into a direction, and the density with which it is chosen.
INLINE void medium_value(const medium_event *e, vec toward, color *value, real *density) {
    *density = phase_of(vec_dot(e->before, toward), e->anisotropy);
    *value = color_of(*density, *density, *density);
}

// A direction chosen by two numbers in (0, 1).
INLINE onward medium_sample(const medium_event *e, real u, real v) {
    const vec direction = phase_direction(e->before, u, v, e->anisotropy);
    const real density = phase_of(vec_dot(e->before, direction), e->anisotropy);
    const mask all = less(R(0.0), R(1.0));
    return (onward){direction, density, color_of(R(1.0), R(1.0), R(1.0)), all, ~all};
}
