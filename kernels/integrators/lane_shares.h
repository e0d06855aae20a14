// Lanes that have something to do, of a share of LANE_SHARE lanes in a row. Where few of a packet have, what is done for one costs as much as
// for all: so packets with many such lanes are taken as they are, and of all others these lanes are gathered. Lanes do not influence each
// other: pictures are the same.
#if LANES > 1
#define FEW_LANES (LANES / 2)   // of a packet that is not taken as it is

typedef struct {
    int found, taken;        // lanes that are gathered, and those of them that are done
    int lanes[LANE_SHARE];   // their numbers
} lane_list;

// Adds a packet's lanes, as bits, of which the first has this number.
INLINE void lanes_listed(lane_list *left, uint those, int first) {
    while (those != 0) {
        const int lane = highest_bit(those);
        those ^= 1u << lane;
        left->lanes[left->found++] = first + lane;
    }
}

// Takes a packet of them, if any are left; the result says so. Where too few are left some lanes do the last one's work again.
INLINE int lanes_taken(lane_list *left, int *numbers, lane_places *places_of) {
    if (left->taken >= left->found) return 0;
    for (int lane = 0; lane < LANES; ++lane) numbers[lane] = left->lanes[min(left->taken + lane, left->found - 1)];
    left->taken += LANES;
    places_of->apart = 1;
#define PLACE_LANE(i) places_of->each.s##i = numbers[0x##i];
    EACH_LANE(PLACE_LANE)
    return 1;
}
#endif
