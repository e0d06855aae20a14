// How interactions look in Phong's light: by the scene's material, or an object's own (see clfractal/geometry/objects.py).
typedef struct {
    real ambient, diffuse, surround, shininess, sharp;
    color specular, mirror, mirror_edge, emission;
} phong_material;
NUMBERS_PICKED(phong_material)

CALLED phong_material phong_material_of_object(real object, world w) {
    material_record m = w.material;
    const color none = color_of(R(0.0), R(0.0), R(0.0));
    const real specular = (real)(m->specular), mirror = (real)(m->reflection);
    phong_material found = {(real)(m->ambient), (real)(m->diffuse), (real)(m->diffuse), (real)(m->shininess), R(0.0),
                  color_of(specular, specular, specular), color_of(mirror, mirror, mirror), none, none};
    for (int i = 0; i < w.settings->object_count; ++i) {
        const mask there = equal(object, (real)((scalar)(i + 1)));
        if (!any_lane(there)) continue;
        object_record o = w.objects + i;
        const phong_material own = {(real)(o->ambient), (real)(o->diffuse), (real)(o->surround), (real)(o->shininess), (real)(o->sharp),
                          color_splat(o->specular), color_splat(o->mirror), color_splat(o->mirror_edge), color_splat(o->emission)};
        found = phong_material_pick(there, own, found);
    }
    return found;
}

INLINE phong_material phong_material_of(const interaction *here, world w) {
    phong_material found = phong_material_of_object(here->object, w);
    if (!any_lane(less(R(0.0), here->share))) return found;
    const phong_material other = phong_material_of_object(here->other, w);
    for (int i = 0; i < NUMBERS_OF(phong_material); ++i) {
        ((real *)&found)[i] += here->share * (((const real *)&other)[i] - ((real *)&found)[i]);
    }
    return found;
}

INLINE real surround_of(phong_material l) { return l.surround; }

// Eq. 5; beside objects with a look. What a light with a size shows in a mirror is its picture there, and no highlight.
INLINE color shaded(color surface, vec normal, vec to_viewer, incidence in, mask lit, real open,
                    light_record light, phong_material l, world w) {
    if (w.settings->object_count == 0) return phong(surface, normal, to_viewer, in, lit, open, light, w.material);
    const attitude a = attitude_to(in, normal, to_viewer, lit);
    const real diffuse = pick(a.front, l.diffuse * a.facing, R(0.0));
    const mask shines = a.front & less(R(0.0), a.toward_viewer);
    real highlight = pick(shines, pow(pick(shines, a.toward_viewer, R(1.0)), l.shininess), R(0.0));
    if (light->seen) highlight *= R(1.0) - l.sharp;
    const color body = color_scale(surface, l.ambient * open + diffuse);
    const color brings = color_add(body, color_scale(l.specular, highlight));
    return color_scale(color_mul(brings, color_splat(light->color)), in.strength);
}

// The part of the surroundings that an interaction mirrors sharply, to a ray that came along `direction` (Schlick 1994).
INLINE color mirrored_at(const interaction *here, vec direction, world w) {
    const real part = (real)(w.material->reflection);
    if (w.settings->object_count == 0) return color_of(part, part, part);
    const phong_material l = phong_material_of(here, w);
    const real grazing = clamp(R(1.0) + vec_dot(direction, here->normal), R(0.0), R(1.0)), square = grazing * grazing;
    return color_add(l.mirror, color_scale(l.mirror_edge, square * square * grazing));
}
