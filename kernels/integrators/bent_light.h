// Light that boundaries of a clear body bend, smooth or slightly rough ones, on its way to an event: sampled through chains (`chains.h`), and
// weighed against what paths find by chance by the power heuristic (Veach and Guibas 1995), so that none is lost and none counts twice.
//
// A path is followed from its last event that is not on glass on (`bent`): if it then comes to a light over the boundaries of one body alone,
// sampling could have found its way. How likely that is follows from the direction in which it set out, whose chain is followed, not searched:
// facets of glass are never quite flat, so that no chain may lead to the very place that the path has come to, while its weight as a function
// of the direction, and of facets of rough boundaries, is the same for both. Its density is told as `light_at_end` and `emitter_share` expect
// it. All others keep all of their light.
#include "integrators/bent_ways.h"

#define NO_CHAIN R(-1.0)   // of boundaries that have been crossed: nobody samples what comes

// What boundaries were crossed by a path that arrives at its next interaction.
INLINE void bent_goes_on(bent *ways, const path *so_far, const path_state *with, mask here) {
    const mask begins = here & equal(ways->body, R(0.0)) & equal(ways->crossed, R(0.0)) & less_equal(R(0.0), with->density);
    // From the open into the body and out again, or from within it.
    const mask from_open = equal(ways->start, R(0.0)), first = equal(ways->crossed, R(0.0));
    const real next = pick(equal(number_of(first), number_of(from_open)), ways->body, R(0.0));
    const mask crosses = here & ~begins & less(R(0.0), ways->body) & less_equal(R(0.0), ways->crossed) & equal(with->medium, next)
                         & ~equal(with->medium, ways->medium) & (from_open | equal(ways->start, ways->body));
    ways->from = vec_pick(begins, so_far->origin, ways->from);
    ways->toward = vec_pick(begins, so_far->direction, ways->toward);
    ways->density = pick(begins, with->density, ways->density);
    ways->total = pick(begins, with->total, ways->total);
    ways->start = pick(begins, with->medium, ways->start);
    ways->crossed = pick(crosses, ways->crossed + R(1.0), pick(begins, R(0.0), NO_CHAIN));
    ways->body = pick(begins | crosses, ways->body, R(0.0));
    ways->medium = with->medium;
}

// How likely directions are chosen that lead past all, times what all lights weigh.
INLINE real past_density(vec from, vec direction, world w) {
    real sum = R(0.0);
    if (has_environment(w.material)) {
        sum = (real)(w.settings->environment_weight) * environment_density(direction, w.material, w.environment);
    }
    for (int i = 0; i < w.settings->single_lights; ++i) {
        const mask met = light_met(w.lights + i, direction);
        if (!any_lane(met)) continue;
        sum += pick(met, light_weight(w.lights + i, &from, w.tables) * light_density(w.lights + i, from, direction), R(0.0));
    }
    return sum;
}

// The facets over which a path has gone that leaves a body's last boundary.
INLINE facets facets_crossed(object_record o, real index, const bent *ways, const path *so_far, mask within, world w) {
    facets f = facets_of(o, ways->from, w);
    if (f.wide <= S(0.0)) return f;
    const vec last = so_far->origin;
    vec way = ways->toward;
    if (crosses_twice(o)) {
        const vec at = object_place(o, vec_along(ways->from, shape_crossed(o, &ways->from, &way, 0), way));
        const vec inner = vec_normalize(vec_sub(last, at));
        facet_met(&f, 0, chain_site_at(o, at).normal, way, inner, R(1.0) / index);
        way = inner;
    }
    const int i = crosses_twice(o);
    facet_met(&f, i, chain_site_at(o, last).normal, way, so_far->direction, i ? index : pick(within, index, R(1.0) / index));
    return f;
}

// What paths have come to over the boundaries of a body which arrive `far` away at an object, or where nothing was met (`lands` tells which)
// at a light or past all.
CALLED void bent_arrives_over(object_record o, const bent *ways, const path *so_far, path_state *with, real far, real object, mask lands, mask here,
                              world w) {
    const vec from = ways->from, vantage = bent_vantage(o, from);
    const light_hit before = light_hit_of(so_far->origin, so_far->direction, 0, &far, w);
    const mask past = here & ~lands & ~before.met, at_object = here & lands & ~before.met;
    mask known = past;
    vec normal = vec_of(R(0.0), R(0.0), R(0.0));
    const vec place = vec_along(so_far->origin, pick(past, R(0.0), far), so_far->direction), offset = vec_sub(place, vantage);
    const real distance = sqrt(vec_dot(offset, offset));
    const vec straight = vec_pick(past, so_far->direction, vec_scale(offset, R(1.0) / fmax(distance, (real)(REAL_SMALLEST))));
    // With which densities the light's place is chosen: for where the chain begins, and for where the path has set out last.
    real chosen = R(0.0), of_last = before.weight / with->total * before.density;
    const vec way = so_far->direction, inverse = vec_of(tree_inverse(way.x), tree_inverse(way.y), tree_inverse(way.z));
    lamp_turn turn = {0, 0};
    mask asks;
    // (A box that ends where the lamp is met is entered before.)
    for (;;) {
        const int singles = w.settings->single_lights;
        const int i = next_lamp(&turn, singles, w.settings->tree_nodes, LIGHT_TREE(w), so_far->origin, inverse, far * R(1.001), &asks);
        if (i < 0) break;
        light_record light = w.lights + i;
        if (!light->seen) continue;
        real t;
        const mask met = here & before.met & asks & light_met_at(light, so_far->origin, so_far->direction, &t) & equal(t, far);
        if (!any_lane(met)) continue;
        known |= met;
        normal = vec_pick(met, light_normal(light, place), normal);
        const real weight = i < singles ? light_weight(light, &from, w.tables) : tree_lamp_weighs((real)((scalar)i), &from, met, w);
        chosen = pick(met, weight / ways->total * light_density(light, vantage, straight), chosen);
    }
    // (What is infinitely far away is seen alike from everywhere.)
    if (any_lane(past)) {
        chosen = pick(past, past_density(from, so_far->direction, w) / ways->total, chosen);
        of_last = pick(past, past_density(so_far->origin, so_far->direction, w) / with->total, of_last);
    }
    if (HAS(w, EMITTERS)) {
        for (int i = 0; i < w.settings->emitter_count; ++i) {
            object_record emitter = emitter_record(i, w);
            const mask met = at_object & equal(object, emitter_thing(emitter));
            if (emitter->sought || !any_lane(met)) continue;
            known |= met;
            normal = vec_pick(met, object_normal(emitter, place, w.tables), normal);
            const real density = emitter_density(emitter, &vantage, &straight, distance);
            chosen = pick(met, emitter_weighs(i, emitter, from, met, w) / ways->total * density, chosen);
            const real last = emitter_density(emitter, &so_far->origin, &so_far->direction, far);
            of_last = pick(met, emitter_weighs(i, emitter, so_far->origin, met, w) / with->total * last, of_last);
        }
    }
    if (!any_lane(known)) return;
    // Over a level the path has crossed it where its last ray begins.
    const chain_end end = {vec_pick(past, straight, place), past, pick(past, (real)(REAL_LARGEST), distance)};
    const mask within = ~equal(ways->start, R(0.0));
    const real index = bent_index(o, w);
    const facets f = facets_crossed(o, index, ways, so_far, within, w);
    const chain c = chain_followed(o, &f, index, &from, &ways->toward, &so_far->origin, within, &end);
    const real narrows = faces_bent(normal, straight, so_far->direction) / fmax(c.turns, CHAIN_TURNS);
    // The same shares of both follow from them where lights were chosen last.
    const real told = ways->density * c.chance * narrows * of_last / fmax(chosen, R(1e-20));
    const mask sampled = known & ~mask_of(c.fails) & less(R(0.0), chosen) & less(R(0.0), narrows);
    // (Their last boundary, which would sample lights, too, samples none: `bent_answered`.)
    with->density = pick(sampled, fmin(told, R(1e12)), pick(known, R(-1.0), with->density));
}

CALLED void bent_arrives(const bent *ways, const path *so_far, path_state *with, real far, real object, mask lands, mask here, world w) {
    here &= less(R(0.0), ways->body);
    for (int i = 0; i < w.settings->object_count; ++i) {
        object_record o = w.objects + i;
        const mask over = here & equal(ways->body, (real)((scalar)(i + 1))) & equal(ways->crossed, (real)((scalar)o->bends));
        if (o->bends && any_lane(over)) bent_arrives_over(o, ways, so_far, with, far, object, lands, over, w);
    }
}

// Which interactions sample light through clear bodies, and notes at which of these a path stands: all but those on glass and on what shines.
INLINE mask bent_lands(bent *ways, const path_state *with, const interaction *found, mask lands, world w) {
    const mask of_set = of_the_set(found->object, w);
    mask samples = lands & ~(of_set & is_set_body(body_of_thing(found->object, w), w)) & equal(with->under, R(0.0));
    mask open = equal(with->medium, R(0.0)), valid = lands & ~lands, answered = valid;
    for (int i = 0; i < w.settings->object_count; ++i) {
        object_record o = w.objects + i;
        const real number = (real)((scalar)(i + 1));
        const mask on = equal(found->object, number);
        if (o->glass || o->sampled) samples &= ~on;
        if (!o->bends) continue;
        if (!crosses_twice(o)) open |= equal(with->medium, number);
        const mask first = equal(ways->body, R(0.0)) & equal(ways->crossed, R(0.0));
        const mask again = equal(ways->body, number) & less(R(0.0), ways->crossed) & less(ways->crossed, (real)((scalar)o->bends));
        const mask here = lands & on & (first | again);
        ways->body = pick(here, number, ways->body);
        valid |= here;
        const mask last = equal(ways->crossed, (real)((scalar)(o->bends - 1))), begun = equal(ways->start, R(0.0)) | equal(ways->start, number);
        answered |= here & last & begun;
    }
    samples &= open;
    ways->body = pick(valid, ways->body, R(0.0));
    ways->crossed = pick(samples, R(0.0), pick(valid, ways->crossed, NO_CHAIN));
    ways->answered = number_of(answered & valid);
    return samples;
}

// Sends the rays of a chain, which find out whether anything is in its way.
INLINE void chain_sent(stage s, int turn, vec from, const bent_way *b, real footprint, mask wanted, world w) {
    const chain *c = &b->way;
    const vec to_boundary = vec_sub(c->enters, from);
    const real over = vec_dot(c->beyond, c->arrives), side = b->lift * pick(less(R(0.0), over), R(1.0), R(-1.0));
    const vec leaves = vec_along(c->leaves, side, c->beyond), to_end = vec_sub(b->end, leaves);
    const mask far = mask_of(b->end_far), two = wanted & less(R(0.5), b->two);
#define CLEAR_OF(normal, way) R(4.0) * b->lift / fmax(fabs(vec_dot(normal, way)), R(0.02))
    const ray first = {from, b->toward, R(0.0), sqrt(vec_dot(to_boundary, to_boundary)) - CLEAR_OF(c->before, b->toward), footprint, R(0.0),
                       RAY_NOTHING_KNOWN};
    const ray last = {leaves, vec_pick(far, c->arrives, vec_normalize(to_end)), R(0.0),
                      pick(far, (real)(REAL_LARGEST), R(0.9999) * sqrt(vec_dot(to_end, to_end))), footprint, R(0.0), RAY_NOTHING_KNOWN};
    send_clipped(s, turn, first, R(0.0), WHETHER, wanted & less(R(0.0), first.far), w);
    send_clipped(s, turn + 1, last, R(0.0), WHETHER, wanted & less(R(0.0), last.far), w);
    if (w.settings->chain_rays > 2) {
        const vec inner = vec_along(c->enters, -b->lift, c->before), to_leave = vec_sub(c->leaves, inner), way = vec_normalize(to_leave);
        const ray within = {inner, way, R(0.0), sqrt(vec_dot(to_leave, to_leave)) - CLEAR_OF(c->beyond, way), footprint, R(0.0), RAY_NOTHING_KNOWN};
        send_clipped(s, turn + 2, within, R(0.0), WHETHER, two & less(R(0.0), within.far), w);
    }
#undef CLEAR_OF
}

// Samples a light through a clear body, and sends the rays to it.
INLINE void bent_samples(stage s, const packet_pixels *at, int turn, bent *ways, const path *so_far, const path_state *with, interaction *found,
                         vec arrived, mask samples, world w) {
    const vec to_viewer = vec_scale(arrived, R(-1.0));
    found->normal = facing(found->normal, arrived);
    vec shading = found->normal;
    const mask none = samples & ~samples;
    pbr p = pbr_of_interaction(s, found, w);
    event e;
    e.surface = bsdf_of_interaction(s, found, &p, none, to_viewer, &shading, w);
    event_placed(&e, found, shading, found->normal, w);
    e.behind = none;
    e.before = arrived;
    real numbers[LIGHT_SAMPLE_NUMBERS];
    path_light_numbers(s, at, w, numbers);
    choosing c = choose_light(e.point, e.from, e.normal, e.own, numbers, weight_of_all(e.from, e.own, w), w);
    mask wanted = samples & ~c.found.unblocked & equal(c.found.sought, R(0.0));
    const bent_event sampled = {e.from, e.normal, with->medium, wanted};
    const bits seed = pixel_seed(at->columns, at->rows, (uint)w.settings->seed, PURPOSE_CHAIN + NEXT_BOUNCE * (uint)s.bounce);
    bits stream = hash_bits(seed + (bits)((uint)s.sample * 0x85ebca6bu));
    bent_choice chosen;
    wanted &= bent_way_found(&sampled, &c, numbers, &stream, &chosen, w);
    const bent_way *b = &chosen.way;
    if (any_lane(wanted)) {
        const vec toward = vec_pick(wanted, b->toward, to_viewer);
        color value;
        real density;
        event_value(&e, toward, w, &value, &density);
        // A path comes there within its bounces, or not at all.
        const real last = (real)((scalar)(w.settings->bounces - s.bounce)) - b->two;
        density = pick(wanted & less(R(0.0), last), density * b->chance * b->narrows, R(0.0));
        value = color_mul(color_scale(color_mul(value, b->through), b->narrows), so_far->through);
        c.found.ray.light = b->light;
        c.found.ray.density = b->density;
        color brings = sampled_light_brings(&c.found, value, density);
        brings = color_scale(brings, b->chances * chosen.all / fmax(chosen.weight, (real)(REAL_SMALLEST)));
        const mask end_far = mask_of(b->end_far);
        const vec onward = vec_sub(b->end, b->way.leaves);
        real far = pick(end_far, (real)(REAL_LARGEST), sqrt(vec_dot(onward, onward)) * R(0.999));
        wanted &= less(R(0.0), brightest(brings)) & ~light_hit_of(b->way.leaves, b->way.arrives, 0, &far, w).met;
        // Paths end at lamps on their way to the boundaries, too.
        const vec first = vec_sub(b->way.enters, e.from), inner = vec_sub(b->way.leaves, b->way.enters);
        far = sqrt(vec_dot(first, first)) * R(0.999);
        wanted &= ~light_hit_of(e.from, b->toward, 0, &far, w).met;
        if (w.settings->chain_rays > 2) {
            const real chord = sqrt(vec_dot(inner, inner));
            far = chord * R(0.999);
            const vec way = vec_scale(inner, R(1.0) / fmax(chord, (real)(REAL_SMALLEST)));
            wanted &= ~(less(R(0.5), b->two) & light_hit_of(b->way.enters, way, 0, &far, w).met);
        }
        ways->awaited = color_pick(wanted, s.bounce > 0 ? limited(brings, w.settings) : brings, ways->awaited);
    }
    chain_sent(s, turn, e.from, b, found->cone * (real)(w.settings->shadow_detail), wanted, w);
}

CALLED void packet_bends_light(stage s, const packet_pixels *at, int turn, world w) {
    const camera_sample a = camera_sample_kept(s);
    interaction found = interaction_kept(s, s.bounce);
    path so_far;
    const ray arrived = path_ray(s, eye_ray(&a, w.view), a.wanted, &so_far);
    path_state with;
    const halt stop = path_carries(s, &so_far, &with, arrived.origin, w);
    const mask on_path = mask_of(so_far.on_path) & equal(stop.halted, R(0.0));
    const color black = color_of(R(0.0), R(0.0), R(0.0));
    const vec nowhere = vec_of(R(0.0), R(0.0), R(0.0));
    bent ways = {nowhere, nowhere, R(0.0), R(0.0), R(0.0), R(0.0), NO_CHAIN, R(0.0), R(0.0), black};
    real far = way_to_interaction(&found, arrived);
    if (s.bounce > 0) {
        STATE_RECALL(s, ways, STATE_BENT);
        bent_goes_on(&ways, &so_far, &with, on_path);
        bent_arrives(&ways, &so_far, &with, far, found.object, mask_of(found.found), on_path, w);
        path_state_keep(s, &with);
    }
    ways.awaited = black;
    const light_hit before = light_hit_of(arrived.origin, arrived.direction, s.bounce == 0, &far, w);
    const mask samples = bent_lands(&ways, &with, &found, on_path & mask_of(found.found) & ~before.met, w);
    if (any_lane(samples)) {
        path_absorbs(&so_far, &with, far, on_path, w);
        bent_samples(s, at, turn, &ways, &so_far, &with, &found, arrived.direction, samples, w);
    } else {
        for (int i = 0; i < w.settings->chain_rays; ++i) queue_skip(s.q, turn + i, s.slot);
    }
    STATE_KEEP(s, ways, STATE_BENT);
}
