// Packets of paths that go on: a work-item has a share of a tile's packets.
#include "integrators/lane_shares.h"

// Does something for each packet: DO(stage, its pixels, world).
#if LANES == 1
#define FOR_PATHS(DO)                                                                                       \
    PATH_STAGE_BEGINS(s, w);                                                                                \
    const place_in_pass here = place_of_packet(s.span, s.packet, s.tile);                                   \
    DO(s, &here.at, w)
#else
// The packet that is next, if one is left: packet number `next` of the tile and those after it, then what has been gathered of these.
INLINE int paths_next(int *next, int end, lane_list *left, const stage *first, stage *s, packet_pixels *at) {
    const int4 corner = first->span.places[first->tile];
    while (*next < end) {
        const int number = *next - first->packet;
        *next += 1;
        *s = stage_moved(*first, number);
        const uint those = lanes_bits(paths_left(*s));
        if (bits_count(those) > FEW_LANES) {
            *at = packet_at(s->packet, (int2)(corner.x, corner.y), s->span.view);
            return 1;
        }
        lanes_listed(left, those, number * LANES);
    }
    int numbers[LANES];
    *s = *first;
    if (!lanes_taken(left, numbers, &s->q.lanes)) return 0;
    for (int lane = 0; lane < LANES; ++lane) numbers[lane] += first->packet * LANES;
    *at = pixels_at(numbers, (int2)(corner.x, corner.y));
    return 1;
}

#define FOR_PATHS(DO)                                                                                       \
    if (WAS_CANCELLED) return;                                                                              \
    const pass span_ = PASS;                                                                                \
    const queue queue_ = STAGE_QUEUE;                                                                       \
    const stage first_ = stage_of(ITEM * (LANE_SHARE / LANES), ROW, span_, queue_, state, settings->state_at, first_tile, bounce, sample); \
    const world w = WORLD;                                                                                  \
    lane_list left_;                                                                                        \
    left_.found = left_.taken = 0;                                                                          \
    stage s;                                                                                                \
    packet_pixels at;                                                                                       \
    int next_ = first_.packet;                                                                              \
    const int end_ = min(next_ + LANE_SHARE / LANES, end_packet);                                           \
    while (paths_next(&next_, end_, &left_, &first_, &s, &at)) DO(s, &at, w)
#endif
