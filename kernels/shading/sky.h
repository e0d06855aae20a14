// The background where nothing is hit, for rays from the eye (`mirrored` 0) and for mirrored ones.
INLINE color sky(vec direction, real picture_y, int mirrored, world w) {
    if (has_environment(w.material) && (mirrored || w.material->environment_seen)) return environment_color(direction, w.material, w.environment);
    const real share = mirrored ? R(0.5) - R(0.5) * direction.z : picture_y / (real)((scalar)w.view->height);
    return color_mix(color_splat(w.material->background_top), color_splat(w.material->background_bottom),
                     clamp(share, R(0.0), R(1.0)));
}
