// A renderer whose kernel takes its samples from beginning to end. It defines before this file `world`, what its samples read.
#include "integrators/passes.h"

// Takes one sample at (across, below), in pixels from each pixel's middle.
INLINE pixel_sample take_sample(const packet_pixels *at, real across, real below, int sample, mask active, world w, counters *cost);

// One work-item's part of a pass by a renderer whose kernel takes its samples from beginning to end.
CALLED void render_packet(int packet, int tile, pass s, world w) {
    if (packet >= s.end_packet) return;
    const place_in_pass here = place_of_packet(s, packet, tile);
    pixel p = pixel_before(s, &here);
    const real samples_before = p.samples;
    real hits = R(0.0);
    counters cost = {R(0.0), R(0.0), R(0.0)};
    for (int sample = s.first; sample < s.end; ++sample) {
        if (!any_lane(here.at.in_region & ~less(p.samples, (real)((scalar)sample)))) break;
        const mask active = sample_wanted(s, &here.at, &p, sample);
        if (*(volatile __constant const int *)&s.sampling->cancelled) return;
        if (!any_lane(active)) continue;
        real across, below;
        sample_offset(s, &here.at, sample, &across, &below);
        const pixel_sample found = take_sample(&here.at, across, below, sample, active, w, &cost);
        sample_add(s, &p, found, active, across * across + below * below);
        hits += pick(active & less(R(0.0), found.coverage), R(1.0), R(0.0));
    }
    // A sample that was told to end is worth nothing: what the packet had before stays.
    if (*(volatile __constant const int *)&s.sampling->cancelled) return;
    pass_write(s, &here, &p);
    count_waits_from(s, &here);
    pass_count(&here, s.mode & PASS_ADD, p.samples - samples_before, hits, cost);
}
