// Places of lights that have a size. One that rays can meet has in its file of `elements/lights/area_lights`:
//   vec NAME_light_direction(light_record light, vec point, vec middle, real u, real v)   the direction to a place of it; `middle`: to its middle
//   real NAME_light_density(light_record light, vec point, vec direction)    per steradian, with which that chooses a direction that meets it
//   real NAME_light_distance(light_record light, vec point, vec direction, real middle)   about how far it is there; `middle`: its middle
//   mask NAME_light_met(light_record light, vec origin, vec direction, real *distance)    where a ray meets what shines, from outside
//   vec NAME_light_normal(light_record light, vec place)                     at a place of it, of any length
// Others are discs, as large as their angular size from everywhere.
#include "geometry/rectangles.h"
#include "elements/lights/area_lights"
#include "shading/light_tree.h"

// Where the tree of lamps begins.
#define LIGHT_TREE(w) ((w).tables + (w).settings->light_tree)

#define DIRECTION_OF(KIND, name) case LIGHT_##KIND: return name##_light_direction(light, point, middle, u, v);
INLINE vec light_direction(light_record light, vec point, vec middle, real u, real v) {
    switch (light->kind) { AREA_LIGHTS(DIRECTION_OF) default: return cone_direction(middle, (real)(light->spread), u, v); }
}

#define DENSITY_OF(KIND, name) case LIGHT_##KIND: return name##_light_density(light, point, direction);
INLINE real light_density(light_record light, vec point, vec direction) {
    switch (light->kind) { AREA_LIGHTS(DENSITY_OF) default: return R(1.0) / (R(2.0) * LIGHT_PI * (real)(light->spread)); }
}

#define DISTANCE_OF(KIND, name) case LIGHT_##KIND: return name##_light_distance(light, point, direction, middle);
INLINE real light_distance(light_record light, vec point, vec direction, real middle) {
    switch (light->kind) { AREA_LIGHTS(DISTANCE_OF) default: return middle; }
}

#define MET_BY(KIND, name) case LIGHT_##KIND: return name##_light_met(light, origin, direction, distance);
INLINE mask light_met_at(light_record light, vec origin, vec direction, real *distance) {
    switch (light->kind) { AREA_LIGHTS(MET_BY) default: *distance = R(0.0); return less(R(1.0), R(0.0)); }
}

#define NORMAL_OF_LIGHT(KIND, name) case LIGHT_##KIND: return name##_light_normal(light, place);
INLINE vec light_normal(light_record light, vec place) {
    switch (light->kind) { AREA_LIGHTS(NORMAL_OF_LIGHT) default: return vec_of(R(0.0), R(0.0), R(0.0)); }
}

// Light from one of the directions that `light_direction` finds: the mean over these is the light's.
INLINE incidence light_along(light_record light, vec point, vec direction, __global const float *tables) {
    incidence in = light_at(light, point, tables);
    in.toward = direction;
    if (light->seen) {
        in.strength = pick(less(R(0.0), in.strength), (real)(light->intensity) / (LIGHT_PI * light_density(light, point, direction)), R(0.0));
    }
    in.distance = light_distance(light, point, direction, in.distance);
    return in;
}

// About the irradiance that a light can bring to a point.
CALLED real light_weight(light_record light, const vec *point, __global const float *tables) {
    const color c = color_splat(light->color);
    return LIGHT_PI * light_at(light, *point, tables).strength * (R(0.2126) * c.r + R(0.7152) * c.g + R(0.0722) * c.b);
}

// What a lamp of the tree with a number weighs at a place of which is not known how it faces.
INLINE real tree_lamp_weighs(real number, const vec *from, mask here, world w) {
    const vec none = vec_of(R(0.0), R(0.0), R(0.0));
    return tree_total(from, LIGHT_TREE(w)) * tree_descent(from, &none, 1, number, here, LIGHT_TREE(w)).even;
}

// The same as below, of the lights on a set.
INLINE mask met_on_set(vec origin, vec direction, int of_eye, real *far, color *shows, real *density, real *weight, world w);

// The nearest light that a ray meets before `far`, which is 0 of lanes for which nobody asks. The eye's own rays see only visible ones, of
// which nobody asks what they weigh.
CALLED mask nearest_light(const vec *origin, const vec *direction, int of_eye, real *far, color *shows, real *density, real *weight, world w) {
    const int singles = w.settings->single_lights, nodes = w.settings->tree_nodes;
    mask met = less(R(1.0), R(0.0)), of_tree = met;
    real number = R(0.0);
    vec inverse = *direction;
    if (nodes > 0) inverse = vec_of(tree_inverse(direction->x), tree_inverse(direction->y), tree_inverse(direction->z));
    lamp_turn turn = {0, 0};
    while (any_lane(less(R(0.0), *far))) {
        mask asks;
        const int i = next_lamp(&turn, singles, nodes, LIGHT_TREE(w), *origin, inverse, *far, &asks);
        if (i < 0) break;
        light_record light = w.lights + i;
        if (!light->seen || (of_eye && !light->visible)) continue;
        real distance;
        const mask here = asks & light_met_at(light, *origin, *direction, &distance) & less(distance, *far);
        if (!any_lane(here)) continue;
        met |= here;
        *far = pick(here, distance, *far);
        *shows = color_pick(here, color_scale(color_splat(light->color), (real)(light->intensity)), *shows);
        *density = pick(here, light_density(light, *origin, *direction), *density);
        if (i < singles) {
            *weight = pick(here, light_weight(light, origin, w.tables), *weight);
            of_tree &= ~here;
        } else {
            number = pick(here, (real)((scalar)i), number);
            of_tree |= here;
        }
    }
    if (!of_eye && any_lane(of_tree)) *weight = pick(of_tree, tree_lamp_weighs(number, origin, of_tree, w), *weight);
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
