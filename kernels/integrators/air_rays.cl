// Entry points: light that fog scatters to the eye, before the first interaction. They know no formula.
#include "integrators/stages.h"
#include "shading/environment.h"
#include "shading/phase.h"
#include "integrators/interaction.h"
#include "shading/set_lights.h"
#include "shading/light_places.h"
#include "shading/lights.h"
#include "shading/emitters.h"
#include "integrators/secondary.h"
#include "shading/fog.h"
#include "shading/air.h"
#include "shading/air_lights.h"

// Light that is sought in the air needs a ray of its own, which is marched to what it meets before all others (`sought_light.cl`): in the turn
// behind the air's.
INLINE void seek_in_air(stage s, int turn, ray r, const air_light *light, mask wanted, world w) {
    const color black = color_of(R(0.0), R(0.0), R(0.0));
    wanted &= less(R(0.0), light->seeks) & less(light->t, R(1e15)) & less(R(0.0), brightest(light->light));
    const sought seeks = {pick(wanted, light->seeks, R(0.0)), color_pick(wanted, light->light, black), black};
    STATE_KEEP(s, seeks, STATE_SOUGHT);
    const real width = r.footprint + r.spread * light->t;
    // As wide as a path that leaves a surface there.
    const ray finds = {vec_along(r.origin, light->t, r.direction), light->toward, R(0.0), (real)(REAL_LARGEST), width,
                       r.spread + r.footprint / fmax(light->t, width), RAY_NOTHING_KNOWN};
    send_clipped(s, turn, finds, R(0.0), WHICH, wanted, w);
}

// The colours of turns beside those of single lights are kept behind the sum.
INLINE void send_into_air(stage s, int turn, int kept, ray r, air_light light, mask wanted, world w) {
    wanted &= less(light.t, R(1e15)) & less(R(0.0), light.light.r + light.light.g + light.light.b);
    const color brings = color_pick(wanted, light.light, color_of(R(0.0), R(0.0), R(0.0)));
    STATE_KEEP_ONE(s, brings, STATE_AIR, kept);
    const ray shadow_ray = {vec_along(r.origin, light.t, r.direction), light.toward, R(0.0), light.distance,
                      (r.footprint + r.spread * light.t) * (real)(w.settings->shadow_detail), R(0.0), RAY_NOTHING_KNOWN};
    send_clipped(s, turn, shadow_ray, R(0.0), WHETHER, wanted & less(R(0.0), light.distance), w);
}

// Sends a ray for each single light, in the turns from `next_turns` on, then one for the sky's sun, and one for one of all others. Beside
// it stands which part of the light it brings.
STAGE(send_air) {
    STAGE_BEGINS(s, w);
    const place_in_pass here = place_of_packet(s.span, s.packet, s.tile);
    const interaction found = interaction_kept(s, 0);
    const camera_sample a = camera_sample_kept(s);
    const ray r = eye_ray(&a, w.view);
    const air_way way = air_way_of(r, way_in_fog(s, r, &found, w), w.material);
    const mask fogged = fog_at_eye(r.origin, w) & mask_of(a.wanted);
    real u, v, other, choice, unused;
    int i = 0;
    for (; i < w.settings->single_lights; ++i) {
        air_numbers(s, &here.at, i, w, &u, &v, &other);
        const scattering from = scattered_of(&way, w.lights + i, u, v, other, w);
        const ray shadow_ray = {vec_along(r.origin, from.t, r.direction), from.in.toward, R(0.0), from.in.distance,
                          (r.footprint + r.spread * from.t) * (real)(w.settings->shadow_detail), R(0.0), RAY_NOTHING_KNOWN};
        const mask wanted = fogged & less(from.t, R(1e15)) & (w.lights[i].shadow ? ~0 : 0);
        send_clipped(s, next_turns + i, shadow_ray, R(0.0), WHETHER, wanted, w);
        lanes_store(pick(fogged, from.share, R(0.0)), ray_strength(s, next_turns + i));
    }
    if (w.settings->air_sun) {
        air_numbers(s, &here.at, AIR_SUN, w, &u, &v, &other);
        send_into_air(s, next_turns + i, 1, r, sun_in_air(&way, u, v, other, w), fogged, w);
        ++i;
    }
    if (w.settings->air_others) {
        air_numbers(s, &here.at, AIR_OTHERS, w, &u, &v, &other);
        air_numbers(s, &here.at, AIR_OTHERS + 1, w, &choice, &unused, &unused);
        const int seeks = KEEPS(s, STATE_SOUGHT);
        const air_light light = others_in_air(&way, choice, u, v, other, seeks, w);
        send_into_air(s, next_turns + i, 1 + w.settings->air_sun, r, light, fogged & less_equal(light.seeks, R(0.0)), w);
        if (seeks) seek_in_air(s, next_turns + i + 1, r, &light, fogged, w);
    }
}

// Keeps what these rays bring to the end of the sample.
STAGE(gather_air) {
    STAGE_BEGINS(s, w);
    STATE_KEPT(s, counters, cost, STATE_COUNTERS);
    const int singles = w.settings->single_lights, all = singles + w.settings->air_sun + w.settings->air_others;
    color air = color_of(R(0.0), R(0.0), R(0.0));
    for (int i = 0; i < all; ++i) {
        const ray_hit met = queue_met(s.q, next_turns + i, s.slot);
        counters_met(&cost, met, 0);
        color bright;
        if (i < singles) bright = color_scale(color_splat(w.lights[i].color), lanes_load(ray_strength(s, next_turns + i)));
        else STATE_RECALL_ONE(s, bright, STATE_AIR, 1 + i - singles);
        const color more = color_mul(color_splat(w.material->fog_scattering), bright);
        air = color_pick(mask_of(met.hit), air, color_add(air, more));
    }
    STATE_KEEP(s, air, STATE_AIR);
    STATE_KEEP(s, cost, STATE_COUNTERS);
}
