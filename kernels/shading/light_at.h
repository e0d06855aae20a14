// Lights as points see them. A kind is a file of `elements/lights` with this function:
//   incidence NAME_light(light_record light, vec point, __global const float *tables)   how the light comes from its middle
// `tables`: what lights have read begins there at `light->table`.
// One that rays can meet also has a file of `elements/lights/area_lights`, with the functions of `light_places.h`.
#include "shading/incidence.h"
#include "elements/lights"

#define LIGHT_OF(KIND, name) case LIGHT_##KIND: return name##_light(light, point, tables);
INLINE incidence light_at(light_record light, vec point, __global const float *tables) {
    switch (light->kind) {
        LIGHTS(LIGHT_OF)
        default: return (incidence){vec_of(R(0.0), R(0.0), R(1.0)), R(0.0), R(0.0)};
    }
}
