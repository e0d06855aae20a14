// Places of lights that have a size: balls by the cone that they fill, rectangles by their solid angle.
#include "geometry/rectangles.h"

// 1 - cos of half the angle that a light fills; for all but rectangles.
INLINE real light_spread(light_record light, vec point) {
    if (light->kind != LIGHT_SPHERE) return (real)(light->spread);
    const vec offset = vec_sub(vec_splat(light->vector), point);
    const real square = most(vec_dot(offset, offset), (real)(REAL_SMALLEST));
    const real share = least((real)(light->radius * light->radius) / square, R(1.0));
    return share / (R(1.0) + sqrt(R(1.0) - share));
}

// The direction to a place of the light; `middle` is the one to its middle.
INLINE vec light_direction(light_record light, vec point, vec middle, real u, real v) {
    if (light->kind != LIGHT_RECTANGLE) return cone_direction(middle, light_spread(light, point), u, v);
    return rectangle_direction(light, point, u, v);
}

// How far a rectangle's plane is.
INLINE real plane_distance(light_record light, vec point, vec direction) {
    const vec axis = vec_splat(light->axis);
    return vec_dot(vec_sub(vec_splat(light->vector), point), axis) / vec_dot(direction, axis);
}

// Per steradian, with which `light_direction` chooses a direction that meets the light.
INLINE real light_density(light_record light, vec point, vec direction) {
    if (light->kind == LIGHT_RECTANGLE) return rectangle_density(light, point, direction);
    return R(1.0) / (R(2.0) * LIGHT_PI * light_spread(light, point));
}

// Light from one of the directions that `light_direction` finds: the mean over these is the light's.
INLINE incidence light_along(light_record light, vec point, vec direction) {
    incidence in = light_at(light, point);
    in.toward = direction;
    if (light_is_seen(light)) {
        in.strength = pick(less(R(0.0), in.strength), (real)(light->intensity) / (LIGHT_PI * light_density(light, point, direction)), R(0.0));
    }
    if (light->kind == LIGHT_SPHERE) in.distance = most(in.distance - (real)(light->radius), R(0.0));
    if (light->kind == LIGHT_RECTANGLE) in.distance = plane_distance(light, point, direction);
    return in;
}

// Where a ray meets a ball from outside, or a rectangle's shining side.
INLINE mask light_met_at(light_record light, vec origin, vec direction, real *distance) {
    const vec offset = vec_sub(vec_splat(light->vector), origin);
    if (light->kind == LIGHT_SPHERE) {
        const real along = vec_dot(offset, direction);
        const vec across = vec_along(offset, -along, direction);
        const real inside = (real)(light->radius * light->radius) - vec_dot(across, across);
        *distance = along - sqrt(most(inside, R(0.0)));
        return less_equal(R(0.0), inside) & less(R(0.0), *distance);
    }
    *distance = plane_distance(light, origin, direction);
    const vec place = vec_sub(vec_scale(direction, *distance), offset), side = vec_splat(light->side), upward = vec_splat(light->upward);
    const mask front = less(vec_dot(direction, vec_splat(light->axis)), R(0.0)) & less(R(0.0), *distance);
    return front & less_equal(fabs(vec_dot(place, side)), vec_dot(side, side)) &
           less_equal(fabs(vec_dot(place, upward)), vec_dot(upward, upward));
}

// About the irradiance that a light can bring to a point.
CALLED real light_weight(light_record light, const vec *point) {
    const color c = color_splat(light->color);
    return LIGHT_PI * light_at(light, *point).strength * (R(0.2126) * c.r + R(0.7152) * c.g + R(0.0722) * c.b);
}

// The same as below, of the lights on a set.
INLINE mask met_on_set(vec origin, vec direction, int of_eye, real *far, color *shows, real *density, real *weight, world w);

// The nearest light that a ray meets before `far`, its number, or -1; the eye's own rays see only visible ones.
CALLED mask nearest_light(const vec *origin, const vec *direction, int of_eye, real *far, color *shows, real *density, real *weight, world w) {
    mask met = less(R(1.0), R(0.0));
    for (int i = 0; i < w.settings->light_count; ++i) {
        light_record light = w.lights + i;
        if (!light_is_seen(light) || (of_eye && !light->visible)) continue;
        real distance;
        const mask here = light_met_at(light, *origin, *direction, &distance) & less(distance, *far);
        if (!any_lane(here)) continue;
        met |= here;
        *far = pick(here, distance, *far);
        *shows = color_pick(here, color_scale(color_splat(light->color), (real)(light->intensity)), *shows);
        *density = pick(here, light_density(light, *origin, *direction), *density);
        *weight = pick(here, light_weight(light, origin), *weight);
    }
    return met | met_on_set(*origin, *direction, of_eye, far, shows, density, weight, w);
}

// The light with a place that a path's ray meets before `far`.
typedef struct {
    mask met;
    color shows;
    real density, weight;   // with which it is sampled from the ray's origin, where lights weigh as much in all as `path_state` says
} light_hit;

INLINE light_hit light_hit_of(vec origin, vec direction, int of_eye, real *far, world w) {
    light_hit found = {less(R(1.0), R(0.0)), color_of(R(0.0), R(0.0), R(0.0)), R(0.0), R(0.0)};
    found.met = nearest_light(&origin, &direction, of_eye, far, &found.shows, &found.density, &found.weight, w);
    return found;
}
