// The material of a spot: what paths scatter by. Record 0 is the set's, and each object has its own.

#if HAS_OBJECTS
INLINE pbr pbr_pick(mask m, pbr yes, pbr no) {
    for (int i = 0; i < NUMBERS_OF(pbr); ++i) ((real *)&no)[i] = pick(m, ((const real *)&yes)[i], ((const real *)&no)[i]);
    return no;
}
#endif

INLINE pbr pbr_at(const spot *here, world w) {
    pbr found = pbr_of(w.materials, here->tint);
#if HAS_OBJECTS
    for (int number = 1; number <= w.settings->object_count; ++number) {
        const mask there = equal(here->object, (real)((scalar)number));
        if (any_lane(there)) found = pbr_pick(there, pbr_of(w.materials + number, here->tint), found);
    }
#endif
    return found;
}
