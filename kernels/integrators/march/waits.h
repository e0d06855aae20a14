// How long lanes of a packet have waited for others while rays marched. All lanes of a packet go on until its longest orbit ends, but
// for the few that a march leaves under way (packet_orbits.h).

typedef struct {
    int steps;         // lanes without a ray: in steps of the others
    int applications;  // lanes with a ray, whose orbit had ended: in applications of the others
} lane_waits;

// For how many applications each of these lanes has waited, whose orbits had `count`; orbits of lanes that had none have the least.
INLINE mask orbit_waits(mask lanes, real count) {
#if LANES == 1
    return 0;
#else
    const mask whole = CONVERT(OF_LANES(INTEGER), count);
    return lanes & (lanes_most(whole) - whole);
#endif
}

// Adds what a work-item's share has waited to the counts of a packet. A single lane waits for nobody.
#define COUNT_LANE_WAITS(waits, statistics)                                                 \
    if (LANES > 1) {                                                                       \
        atomic_add((statistics) + STATISTIC_WAITS, (uint)(waits).steps);                   \
        atomic_add((statistics) + STATISTIC_ORBIT_WAITS, (uint)(waits).applications);      \
    }
