// Interactions of the surface, of what marches have met.

// Normals of an interaction: only the first one, and that of pixels with points, may have several.
INLINE int facet_count(int bounce, world w) { return bounce == 0 ? w.settings->normal_count : 1; }

INLINE facet facet_of(stage s, const interaction *here, int i, world w) {
    facet f = {here->normal, R(1.0)};
    if (facet_count(s.bounce, w) > 1) STATE_RECALL_ONE(s, f, STATE_FACET, i);
    return f;
}

// Whether any normal of the interaction faces that way. (With the mean normal only, a rough interaction's other normals would have no shadow.)
INLINE mask faces(stage s, const interaction *here, vec direction, world w) {
    mask any_normal = less(R(1.0), R(0.0));
    for (int i = 0; i < facet_count(s.bounce, w); ++i) {
        const facet f = facet_of(s, here, i, w);
        any_normal |= less(R(0.0), f.weight) & less(R(0.0), vec_dot(f.normal, direction));
    }
    return any_normal;
}

// The colour of a thing: the set's, or that of the object with this number. The face of an object's cut shows the plane's colour of
// insides; what that of the set's shows only the formula knows.
INLINE color object_color(vec normal, real quantity, real object, world w) {
    color found = surface_color(normal, quantity, w.material, w.palette);
    const real plane = plane_of_face(object);
    for (int i = 0; i < w.planes.count; ++i) found = color_pick(equal(plane, (real)((scalar)i)), color_splat(w.planes.planes[i].inside), found);
    for (int i = 0; i < w.settings->object_count; ++i) {
        const mask here = equal(object, (real)((scalar)(i + 1)));
        if (w.objects[i].colored && any_lane(here)) found = color_pick(here, color_splat(w.objects[i].color), found);
    }
    return found;
}

// The colour of an interaction: where two solids flow together, a blend of theirs.
INLINE color interaction_color(vec normal, real quantity, real object, real other, real share, world w) {
    const color own = object_color(normal, quantity, object, w);
    if (any_lane(less(R(0.0), share))) return color_mix(own, object_color(normal, quantity, other, w), share);
    return own;
}

// The same once its quantity is known. Faces have their colour already.
INLINE color tint_of(const interaction *here, world w) {
    const color found = interaction_color(here->normal, here->quantity, here->object, here->other, here->share, w);
    return color_pick(on_face(here), here->tint, found);
}

// What a ray for an interaction has met: the set, or the object with this number, or the face of an object's cut; and the place where it is
// shaded.
INLINE ray_hit surface_met(stage s, int turn, ray r, real *object, vec *place, world w) {
    const ray_hit met = queue_met(s.q, turn, s.slot);
    *place = vec_along(r.origin, met.touch, r.direction);
    *object = pick(mask_of(met.hit), met.solid, R(0.0));
    if (!s.q.objects) return met;
    const real beside = queue_object(s.q, turn, s.slot, met);
    const mask here = less(R(0.0), beside);
    if (!any_lane(here)) return met;
    vec found;
    RECALL(found, s.q.rays + RAY_OBJECT_PLACE * s.q.stride + turn * s.q.wave + s.slot, s.q.stride);
    *place = vec_pick(here, found, *place);
    *object = pick(here, beside, *object);
    return met;
}

#define LIFT_ERRORS R(32.0)   // roundings of the largest number by which a place is told

INLINE real largest_of(vec a) { return fmax(fmax(fabs(a.x), fabs(a.y)), fabs(a.z)); }

// How far over an interaction rays leave it: far enough from the set not to meet the very bump that they start from. An object has none, nor
// has a face: from those rays leave as near as numbers are sure to be on the right side (Pharr, Jakob, Humphreys 2023, sec. 6.8). The face of
// a joined part is a part of the set, which marches find.
INLINE real lift_of(const interaction *here, world w) {
    real lift = here->cone * (real)(w.settings->shadow_lift);
    if (w.settings->object_count + w.planes.count == 0) return lift;
    const real own = largest_of(here->point), each = LIFT_ERRORS * (real)(REAL_EPSILON), cut = thing_cut(here->object);
    mask beside = less(R(0.0), R(1.0));
    for (int i = 0; i < w.settings->object_count; ++i) {
        __global const struct Object *o = w.objects + i;
        if (o->kind == OBJECT_JOINED) beside &= ~equal(cut, (real)((scalar)(i + 1)));
        const mask on = o->kind == OBJECT_JOINED ? less(R(1.0), R(0.0)) : equal(here->object, (real)((scalar)(i + 1)));
        lift = pick(on, (real)(o->lift) * here->cone + each * ((real)(o->error_share) * own + (real)(o->error)), lift);
    }
    const real plane = plane_of_face(here->object);
    for (int i = 0; i < w.planes.count; ++i) {
        const mask on = beside & equal(plane, (real)((scalar)i));
        lift = pick(on, each * (own + largest_of(vec_splat(w.planes.planes[i].center))), lift);
    }
    return lift;
}

// The interaction where one ray has met the surface.
INLINE interaction interaction_of_ray(ray r, ray_hit met, real object, vec place, world w) {
    interaction here;
    here.found = met.hit;
    here.point = place;
    here.seen = vec_along(r.origin, met.t, r.direction);
    here.normal = met.normal;
    here.cone = r.footprint + r.spread * met.t;
    here.smooth = met.smooth;
    here.residual = R(0.0);
    here.quantity = R(0.0);
    here.tint = interaction_color(met.normal, met.smooth, object, met.other, met.part, w);
    here.object = object;
    here.other = met.other;
    here.share = met.part;
    return here;
}

// Where the ray for an interaction meets a face of the set before all else, that is the interaction: such lanes are the result.
INLINE mask interaction_on_face(stage s, ray r, interaction *here, world w) {
    STATE_KEPT(s, plane_face, face, STATE_FACE);
    const mask bare = less(R(0.0), face.number);
    if (!any_lane(bare)) return bare;
    here->found = pick(bare, R(1.0), here->found);
    here->seen = vec_pick(bare, vec_along(r.origin, face.t, r.direction), here->seen);
    const real number = plane_of_face(face.number);
    for (int i = 0; i < w.planes.count; ++i) {
        const mask on = bare & equal(number, (real)((scalar)i));
        here->point = vec_pick(on, place_on_plane(w.planes.planes + i, here->seen), here->point);
    }
    here->normal = vec_pick(bare, face.normal, here->normal);
    here->cone = pick(bare, r.footprint + r.spread * face.t, here->cone);
    here->smooth = pick(bare, face.count, here->smooth);
    here->tint = color_pick(bare, face.tint, here->tint);
    here->object = pick(bare, face.number, here->object);
    here->share = pick(bare, R(0.0), here->share);
    return bare;
}

// Where a ray within a body of the set comes to a plane that opens it before all else, it has met the face there from behind.
INLINE void leaves_by_face(ray r, real body, mask within, ray_hit *met, real *object, vec *place, world w) {
    real plane;
    const real way = way_to_cut(r.origin, r.direction, &plane, w.planes), radius = (real)(w.settings->bounds_radius);
    const vec point = vec_along(r.origin, way, r.direction), arm = vec_sub(point, vec_splat(w.settings->bounds_center));
    const mask there = within & less_equal(R(0.0), plane) & ~(mask_of(met->hit) & less(met->t, way)) & less(vec_dot(arm, arm), radius * radius);
    if (!any_lane(there)) return;
    for (int i = 0; i < w.planes.count; ++i) {
        const mask on = there & equal(plane, (real)((scalar)i));
        met->normal = vec_pick(on, vec_scale(vec_splat(w.planes.planes[i].normal), R(-1.0)), met->normal);
        *place = vec_pick(on, place_on_plane(w.planes.planes + i, point), *place);
    }
    met->hit = pick(there, R(1.0), met->hit);
    met->t = pick(there, way, met->t);
    met->part = pick(there, R(0.0), met->part);
    met->other = pick(there, R(0.0), met->other);
    *object = pick(there, face_number(plane, thing_of_body(body, w)), *object);
}

// What a path has met: its ray within the set is its second one, and was sent in place of the first.
INLINE ray_hit met_within(stage s, ray r, ray_hit met, real *object, vec *place, world w) {
    const ray second = queue_ray(s.q, 1, s.slot);
    const mask within = less(second.near, second.far);
    real other_object;
    vec other_place;
    const ray_hit other = surface_met(s, 1, r, &other_object, &other_place, w);
    *place = vec_pick(within, other_place, *place);
    for (int i = 0; i < NUMBERS_OF(ray_hit); ++i) ((real *)&met)[i] = pick(within, ((const real *)&other)[i], ((real *)&met)[i]);
    *object = pick(within, other_object, *object);
    if (w.planes.count > 0) leaves_by_face(second, lanes_load(within_body(s)), within, &met, object, place, w);
    return met;
}

// The normal of an interaction that a path sees: past a rim that of the set faces away, and what sees a surface from behind would have no
// light.
INLINE vec facing(vec normal, vec direction) { return vec_along(normal, R(-2.0) * fmax(vec_dot(normal, direction), R(0.0)), direction); }

// What a march has cost, and where `of_surface` what finding its normal has.
INLINE void counters_met(counters *cost, ray_hit met, int of_surface) {
    cost->steps += met.steps;
    cost->count += met.count;
    if (!of_surface) return;
    const mask hit = mask_of(met.hit);
    cost->steps += pick(hit, met.more_steps, R(0.0));
    cost->count += pick(hit, met.more_count, R(0.0));
    cost->bad += met.bad;
}

