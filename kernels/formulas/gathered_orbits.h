// Surfaces at the points of several packets: the lanes of one take point after point, so that none waits for another's orbit. No point's
// numbers depend on that.
#include "formulas/dual_orbits.h"

#if CARRIES
#define GATHERED 16                   // packets
#define GATHERED_LEFT (LANES / 4)     // orbits under way that are left while other lanes take the next points
#define GATHERED_POINTS (GATHERED * LANES)
#define GATHERED_FOUND 7

typedef struct {
    uint asked[GATHERED];                             // lanes of each packet, as bits
    scalar points[3][GATHERED_POINTS];
    scalar found[GATHERED_FOUND][GATHERED_POINTS];    // see `gathered_surface`
} gathered;

INLINE void gathered_ask(gathered *all, int packet, mask asked, vec point) {
    all->asked[packet] = lanes_bits(asked);
    lanes_store(point.x, all->points[0] + packet * LANES);
    lanes_store(point.y, all->points[1] + packet * LANES);
    lanes_store(point.z, all->points[2] + packet * LANES);
}

// What was found for a packet; of lanes that were not asked some numbers.
INLINE orbit_end gathered_surface(const gathered *all, int packet, surface_point *surface) {
    const mask asked = lanes_of_bits(all->asked[packet]);
    real found[GATHERED_FOUND];
#define RECALL_GATHERED(i) found[i] = pick(asked, lanes_load(all->found[i] + packet * LANES), R(1.0));
    WRITTEN_OUT(GATHERED_FOUND, RECALL_GATHERED)
    surface->gradient = vec_of(found[0], found[1], found[2]);
    surface->own.square = found[3];
    surface->own.square_before = found[4];
    return (orbit_end){found[5], less(R(0.0), found[6])};
}

// Asks the formula at all of them.
CALLED void gathered_run(gathered *all, int packets, orbit_record orbit, constants k) {
    dual_orbit o = {0};
    mask late = less(R(1.0), R(0.0));
    dual_limit at_limit = dual_limit_none(late);
    int slots[LANES];
    scalar at[3][LANES] = {{0}}, found[GATHERED_FOUND][LANES];
    int packet = 0;
    for (uint waiting = all->asked[0], busy = 0;;) {
        for (uint idle = ALL_LANES & ~busy; idle != 0;) {
            while (waiting == 0 && packet + 1 < packets) waiting = all->asked[++packet];
            if (waiting == 0) break;
            const int lane = highest_bit(idle), from = highest_bit(waiting), slot = packet * LANES + from;
            idle ^= 1u << lane;
            waiting ^= 1u << from;
            busy |= 1u << lane;
            slots[lane] = slot;
#define TAKE_POINT(i) at[i][lane] = all->points[i][slot];
            WRITTEN_OUT(3, TAKE_POINT)
        }
        if (busy == 0) return;
        surface_point surface;
        const vec point = vec_load(at);
        const clearance here = formula_dual_orbit(&o, point, lanes_of_bits(busy), &late, OF_SURFACE, GATHERED_LEFT, &at_limit, orbit, k,
                                                  &surface);
        vec_store(surface.gradient, found);
        lanes_store(surface.own.square, found[3]);
        lanes_store(surface.own.square_before, found[4]);
        lanes_store(here.end.count, found[5]);
        lanes_store(pick(here.end.inside, R(1.0), R(0.0)), found[6]);
        const uint goes_on = lanes_bits(late);
        for (uint done = busy & ~goes_on; done != 0;) {
            const int lane = highest_bit(done), slot = slots[lane];
            done ^= 1u << lane;
#define KEEP_GATHERED(i) all->found[i][slot] = found[i][lane];
            WRITTEN_OUT(GATHERED_FOUND, KEEP_GATHERED)
        }
        busy = goes_on;
    }
}
#endif
