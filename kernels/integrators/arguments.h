// Arguments of kernels that make pictures.

// The first and the last arguments of a renderer's kernel; its own stand between them. OpenCL 1.2 guarantees eight `__constant` ones:
// lists are `__global`, and constant what all work-items read at the same time.
#define PASS_BUFFERS                                                                                                       \
    __global float *framebuffer, __global scalar *kept, __global uint *statistics, __global const int4 *places,                   \
        __constant const struct View *view, __constant const struct Sampling *sampling
#define PASS_SPAN                                                                                                          \
    __global const int *slots, int channel_count, int kept_count, int first_packet, int end_packet, int first, int end, \
        int mode
#define PASS {framebuffer, kept, statistics, places, view, sampling, slots, channel_count, kept_count, first_packet, end_packet, first, end, mode}

// What every stage of a surface's picture is given: one list, so that the host sets it once.
#define STAGE_ARGUMENTS                                                                                                    \
    PASS_BUFFERS, __constant const struct March *settings, __constant const struct Orbit *orbit,                           \
        __constant const scalar *k, __constant const struct Material *material, __global const struct Light *lights,       \
        __global const float *palette, __global const float *environment, __global const struct CutPlane *planes,          \
        __global const float *plane_palettes, __constant const struct Pbr *materials, __global const float *albedos,            \
        __global const struct Map *maps, __global const float *tables, __global const scalar *set_lights,                       \
        __global const struct Object *objects,                                                                                 \
        __global scalar *restrict state, __global scalar *restrict rays, __global scalar *restrict met,                         \
        PASS_SPAN, int first_tile, int wave, int queue_stride, int turns, int slice, int next_turns, int goal, int bounce, int sample
// The head of a stage's kernel, whose work-item is number ITEM along the first dimension and ROW along the second.
#ifdef DIRECT_BUILT_INS
#define STAGE_GIVEN                                                                                                         \
    framebuffer, kept, statistics, places, view, sampling, settings, orbit, k, material, lights, palette, environment, planes,     \
        plane_palettes, materials, albedos, maps, tables, set_lights, objects, state, rays, met, slots, channel_count, kept_count, first_packet, end_packet, first, end, mode,     \
        first_tile, wave, queue_stride, turns, slice, next_turns, goal, bounce, sample
#define STAGE(name)                                                                                                        \
    CALLED void name##_item(int ITEM, int ROW, STAGE_ARGUMENTS);                                                           \
    __kernel void name(STAGE_ARGUMENTS) { name##_item((int)get_global_id(0), (int)get_global_id(1), STAGE_GIVEN); }         \
    CALLED void name##_item(int ITEM, int ROW, STAGE_ARGUMENTS)
#else
#define ITEM ((int)get_global_id(0))
#define ROW ((int)get_global_id(1))
#define STAGE(name) __kernel void name(STAGE_ARGUMENTS)
#endif
#define STAGE_QUEUE {rays, met, wave, turns, queue_stride, settings->met_numbers, settings->meets_objects, settings->point_count > 1}
// Those of stages that take whatever rays wait, from turn number `next_turns` on: that of a march, which knows nothing of objects beside the
// set (`known`: whether something may be known of rays); and that of objects.
#define MARCH_QUEUE(known) {rays + next_turns * wave, met + next_turns * wave, wave, turns, queue_stride, settings->met_numbers, 0, known}
#define OBJECTS_QUEUE                                                                                                       \
    {rays + next_turns * wave, met + next_turns * wave, wave, turns, queue_stride, settings->met_numbers, settings->meets_objects, settings->point_count > 1}
// The counts of one of the wave's packets, so that those of no packet grow beyond numbers: every work-item's share of rays has another.
#define PACKET_HERE (ITEM % (wave / LANES))
#define STATISTICS_HERE                                                                                                    \
    (statistics + STATISTICS * ((first_tile + PACKET_HERE / (end_packet - first_packet)) * (TILE * TILE / LANES) +         \
                                first_packet + PACKET_HERE % (end_packet - first_packet)))
#define WAS_CANCELLED (*(volatile __constant const int *)&sampling->cancelled)
