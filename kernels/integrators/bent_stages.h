// Light that clear bodies bend on its way to events: the stages BEND and END_BENT of a text that has said which bodies there may be.
#include "integrators/bent_light.h"

// Weighs what paths have come to by chance through a clear body, and samples light through one where they are now: its rays follow those
// that the event sends else, in the turns from `next_turns` on.
STAGE(BEND) {
    PATH_STAGE_BEGINS(s, w);
    const place_in_pass here = place_of_packet(s.span, s.packet, s.tile);
    packet_bends_light(s, &here.at, next_turns, w);
}

// The same of last rays, which only arrive.
STAGE(END_BENT) {
    KEPT_PATH_STAGE_BEGINS(s, w, so_far, with);
    STATE_KEPT(s, bent, ways, STATE_BENT);
    const ray_hit last = queue_met(s.q, 0, s.slot);
    const mask lands = mask_of(last.hit);
    const real object = pick(lands, queue_object(s.q, 0, s.slot, last), R(0.0));
    bent_goes_on(&ways, &so_far, &with, mask_of(so_far.on_path));
    bent_arrives(&ways, &so_far, &with, pick(lands, last.t, (real)(REAL_LARGEST)), object, lands, mask_of(so_far.on_path), w);
    path_state_keep(s, &with);
}
