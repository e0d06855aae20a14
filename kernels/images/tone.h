// Tone curves, operation by operation as clfractal/files/tone.py has them.
//
// `tones` are its tables. Comparisons instead of built-in functions: on processors a built-in may be a call (see direct.h).
#define TONE_MASK ((1 << TONE_SHIFT) - 1)
#define TONE_FIRST (TONE_LOWEST << TONE_SHIFT)
#define TONE_LAST ((TONE_LOWEST + TONE_ENTRIES - 1) << TONE_SHIFT)

// Not a number and negative ones count as 0.
float tone_limited(float value) { return value > 0.0f ? (value > TONE_LIGHTEST ? TONE_LIGHTEST : value) : 0.0f; }

float looked_up(float value, __global const float *table) {
    int bits = as_int(value);
    bits = bits < TONE_FIRST ? TONE_FIRST : bits > TONE_LAST ? TONE_LAST : bits;
    const int index = (bits >> TONE_SHIFT) - TONE_LOWEST;
    const int next = index + 1 < TONE_ENTRIES ? index + 1 : TONE_ENTRIES - 1;
    const float share = (float)(bits & TONE_MASK) * (1.0f / (1 << TONE_SHIFT));
    return table[index] + (table[next] - table[index]) * share;
}

float4 by_luminance(float4 light, __global const float *table) {
    const float luminance = LUMINANCE_R * light.x + LUMINANCE_G * light.y + LUMINANCE_B * light.z;
    const float factor = looked_up(luminance, table);
    light *= factor;
    const float scaled = luminance * factor, shown = scaled < 1.0f ? scaled : 1.0f;
    const float larger = light.x > light.y ? light.x : light.y, peak = larger > light.z ? larger : light.z;
    // What is still too bright gets as much white as brings it into reach, at the same luminance.
    return peak > 1.0f ? shown + (light - shown) * ((1.0f - shown) / (peak - shown)) : light;
}

float in_grey(float4 light) { return TONE_INSET * (GREY_R * light.x + GREY_G * light.y + GREY_B * light.z); }

float outset(float value, float grey) {
    const float found = (value - grey) * TONE_BACK;
    return found > 0.0f ? found : 0.0f;
}

float4 by_component(float4 light, __global const float *table) {
    const float4 inset = light * TONE_KEPT + in_grey(light);
    const float4 bent = (float4)(looked_up(inset.x, table), looked_up(inset.y, table), looked_up(inset.z, table), 0.0f);
    const float grey = in_grey(bent);
    return (float4)(outset(bent.x, grey), outset(bent.y, grey), outset(bent.z, grey), 0.0f);
}

// Light through a curve other than the linear one.
float4 toned(float4 light, __global const float *tones, int tone) {
    light = (float4)(tone_limited(light.x), tone_limited(light.y), tone_limited(light.z), 0.0f);
    return tone == TONE_REINHARD ? by_luminance(light, tones) : by_component(light, tones + TONE_ENTRIES);
}
