// A stage is a kernel that takes every pixel of a wave one step further; `clfractal/integrators/waves.py` has their order.
#include "integrators/passes.h"
#include "integrators/march/queue.h"

// Where an item is none of the picture's packets.
#define IS_BEYOND (ITEM + first_packet >= end_packet || WAS_CANCELLED)

// All data that stages without a formula read.
typedef struct {
    view_record view;
    march_record settings;
    material_record material;
    light_record lights;
    __global const float *palette;
    __global const float *environment;
    plane_set planes;
    __constant const struct Pbr *materials;
    __global const float *albedos;
    map_record maps;
    __global const float *tables;
    __global const scalar *set_lights;
    object_record objects;
} world;
#define PLANE_SET {planes, orbit, k, plane_palettes, objects, settings->plane_count}
#define WORLD {view, settings, material, lights, palette, environment, PLANE_SET, materials, albedos, maps, tables, set_lights, objects}

// Whether a scene has something of which kernels need not know more.
#define HAS(w, feature) ((w).settings->features & FEATURE_##feature)

// A work-item's packet.
typedef struct {
    pass span;
    queue q;
    __global scalar *state;   // see state.h
    __constant const int *at;   // which number of it each part begins with; below 0: the scene has none
    int stride;               // from one number of it to the next
    int packet, tile;         // of the tile, and of the launch
    int slot;                 // number of the packet's first pixel in the wave
    int bounce, sample;
} stage;

INLINE stage stage_of(int item, int row, pass span, queue q, __global scalar *state, __constant const int *at, int first_tile, int bounce,
                      int sample) {
    const int slot = (row * (span.end_packet - span.first_packet) + item) * LANES;
    return (stage){span, q, state + slot, at, q.wave + STATE_PADDING, item + span.first_packet, first_tile + row, slot, bounce, sample};
}
// The same of the packet that is `count` further in the tile.
INLINE stage stage_moved(stage s, int count) {
    s.state += count * LANES;
    s.packet += count;
    s.slot += count * LANES;
    return s;
}
#define STAGE_OF(name)                                                                                                     \
    const pass span_ = PASS;                                                                                               \
    const queue queue_ = STAGE_QUEUE;                                                                                      \
    const stage name = stage_of(ITEM, ROW, span_, queue_, state, settings->state_at, first_tile, bounce, sample)
// The head of a stage: its packet, and all data; items that are none of the picture's packets end.
#define STAGE_BEGINS(name, data)                                                                                           \
    if (IS_BEYOND) return;                                                                                                 \
    STAGE_OF(name);                                                                                                        \
    const world data = WORLD
