// Entry point that knows the formula: the glow around the set that each ray of a path goes through.
#include "lanes.h"
#include "numbers/real.h"
#include "numbers/dual.h"
#include "vectors.h"
#include "structs.h"
#include "formula.h"
#include "solids.h"
#include "camera.h"
#include "sampling.h"
#include "shade.h"
#include "tiles.h"
#include "pixel.h"
#include "coloring.h"
#include "planes.h"
#include "stage.h"
#include "state.h"
#include "eye.h"
#include "fog.h"
#include "glow.h"

// Keeps what the eye's ray sees to the end of the shot; what others see is light of their paths.
STAGE(add_glow) {
    if (IS_BEYOND) return;
    STAGE_OF(s);
    const world w = WORLD;
    const place_in_pass here = place_of_packet(s.span, s.packet, s.tile);
    const aim a = aim_kept(s);
    const spot found = spot_kept(s, bounce);
    path so_far;
    ray r = path_ray(s, eye_ray(&a, view), a.wanted, &so_far);
    const mask wanted = mask_of(bounce == 0 ? a.wanted : so_far.on_path);
    r.far = pick(mask_of(found.found), vec_dot(vec_sub(found.seen, r.origin), r.direction), r.far);
    real ignored;
    const mask clear = planes_cut(&r, &ignored, w.planes);
    const mask near = ray_clip(&r, settings->bounds_center, (real)(settings->bounds_radius) + GLOW_BEYOND * (real)(material->glow_width));
    tally cost;
    STATE_RECALL(s, cost, STATE_TALLY);
    const bits seed = hash_bits(pixel_seed(here.at.columns, here.at.rows, (uint)settings->seed, PURPOSE_GLOW + 16u * (uint)bounce)
                                + (bits)((uint)sample * 0x85ebca6bu));
    const real strength = glow_along(r, wanted & clear & near, seed, &cost, w, orbit, k);
    STATE_KEEP(s, cost, STATE_TALLY);
    const color glow = color_scale(color_splat(material->glow_color), strength);
    if (bounce == 0) {
        STATE_KEEP(s, glow, STATE_GLOW);
    } else {
        so_far.seen = color_add(so_far.seen, color_mul(glow, so_far.through));
        STATE_KEEP(s, so_far, STATE_PATH);
    }
}
