// Entry points: light that fog scatters to the eye, before the first spot. They know no formula.
#include "stages.h"
#include "environment.h"
#include "phase.h"
#include "spot.h"
#include "set_lights.h"
#include "light_places.h"
#include "secondary.h"
#include "fog.h"
#include "air.h"

// Sends a ray for each light, in the turns from `next_turns` on.
STAGE(send_air) {
    if (IS_BEYOND) return;
    STAGE_OF(s);
    const world w = WORLD;
    const place_in_pass here = place_of_packet(s.span, s.packet, s.tile);
    const spot found = spot_kept(s, 0);
    air_send(s, &here.at, aim_kept(s), &found, next_turns, w);
}

// Keeps what these rays bring to the end of the shot.
STAGE(gather_air) {
    if (IS_BEYOND) return;
    STAGE_OF(s);
    const world w = WORLD;
    const place_in_pass here = place_of_packet(s.span, s.packet, s.tile);
    const spot found = spot_kept(s, 0);
    tally cost;
    STATE_RECALL(s, cost, STATE_TALLY);
    air_gather(s, &here.at, aim_kept(s), &found, next_turns, &cost, w);
    STATE_KEEP(s, cost, STATE_TALLY);
}
