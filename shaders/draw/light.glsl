// The key light's share at a place, from the shadow map, and the shading of a place.
#include "draw/frame.glsl"
#include "lib/shading.glsl"

layout(binding = DRAPE_DRAW_UNIT_SHADOW) uniform sampler2DShadow shadow_map;

// Percentage-closer filtering (Reeves, Salesin, Cook 1987): nine taps, each of four texels. The place is moved off
// its surface by the width of a texel, else the surface would shade itself.
float LightShare(vec3 position, vec3 normal) {
  vec3 off_surface = position + 2.0 * frame.to_light.w * (normal + 0.5 * frame.to_light.xyz);
  vec3 place = (frame.shadow_from_world * vec4(off_surface, 1.0)).xyz;
  if (any(greaterThan(abs(place.xy - 0.5), vec2(0.5)))) return 1.0;
  place.z = min(place.z, 1.0);  // behind everything that casts a shadow
  place.xy = frame.shadow_cell.xy + place.xy * frame.shadow_cell.zw;
  float share = 0.0;
  for (int y = -1; y <= 1; ++y) {
    for (int x = -1; x <= 1; ++x) {
      vec2 tap = place.xy + 1.5 * frame.screen.w * vec2(x, y);
      share += texture(shadow_map, vec3(tap, place.z));
    }
  }
  return share / 9.0;
}

vec3 ShadedColour(vec3 base, vec3 position, vec3 normal, float gloss) {
  float light_share = dot(normal, frame.to_light.xyz) > -0.25 ? LightShare(position, normal) : 0.0;
  return LitColour(base, normal, ToViewer(position), frame.to_light.xyz, light_share, gloss);
}
