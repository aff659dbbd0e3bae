// Light on a surface. Linear RGB; unit vectors; `light_share`: the share of the key light that arrives, 0..1.

// Light of the sky and of the ground by the slope of the normal (hemispheric lighting).
vec3 AmbientLight(vec3 normal) {
  const vec3 sky = vec3(0.42, 0.45, 0.50);
  const vec3 ground = vec3(0.25, 0.235, 0.22);
  return mix(ground, sky, 0.5 + 0.5 * normal.y);
}

// Lambert's law with light that reaches a little beyond the terminator, as on cloth.
float WrappedDiffuse(vec3 normal, vec3 to_light) {
  const float wrap = 0.2;
  return max((dot(normal, to_light) + wrap) / (1.0 + wrap), 0.0);
}

// Blinn-Phong highlight; `gloss`: its height.
float Highlight(vec3 normal, vec3 to_viewer, vec3 to_light, float gloss) {
  const float exponent = 28.0;
  return gloss * pow(max(dot(normal, normalize(to_viewer + to_light)), 0.0), exponent);
}

vec3 LitColour(vec3 base, vec3 normal, vec3 to_viewer, vec3 to_light, float light_share,
               float gloss) {
  const vec3 key = vec3(0.56, 0.545, 0.515);
  const float fill = 0.14;  // from the viewer, so that folds show in the shadow as well
  vec3 light = AmbientLight(normal) + fill * max(dot(normal, to_viewer), 0.0) +
               key * light_share * WrappedDiffuse(normal, to_light);
  return base * light +
         light_share * Highlight(normal, to_viewer, to_light, gloss);
}
