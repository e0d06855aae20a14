// Entry point of the cut-plane renderer: one evaluation for each sample.
#include "integrators/cut_plane.h"
#include "integrators/packets.h"

__kernel void cut_plane(PASS_BUFFERS, orbit_record orbit, constants k,
                        plane_record plane, __global const float *palette, PASS_SPAN) {
    const world w = {view, sampling, orbit, k, plane, palette};
    const pass span = PASS;
    render_packet((int)get_global_id(0) + first_packet, (int)get_global_id(1), span, w);
}
