#include "draw/frame.glsl"
#include "lib/colour_map.glsl"

layout(std430, binding = DRAPE_DRAW_BINDING_INSTANCES) readonly buffer Labels {
  LabelRecord labels[];
};
layout(binding = DRAPE_DRAW_UNIT_GLYPHS) uniform sampler2D glyphs;

layout(location = 0) in vec2 texture_place;
layout(location = 1) in vec2 pixel;
layout(location = 2) flat in uint label_index;
layout(location = 0) out vec4 picture;

// 1 inside a box with round corners, 0 outside, between them at the edge.
float BoxShare(vec4 box, float corner_radius) {
  vec2 half_size = 0.5 * (box.zw - box.xy);
  vec2 q = abs(pixel - 0.5 * (box.xy + box.zw)) - half_size + corner_radius;
  float outside = length(max(q, 0.0)) + min(max(q.x, q.y), 0.0) - corner_radius;
  return clamp(0.5 - outside, 0.0, 1.0);
}

void main() {
  LabelRecord label = labels[label_index];
  picture = label.colour;
  if (label.kind == DRAPE_DRAW_LABEL_PANEL) {
    picture.a *= BoxShare(label.box, label.corner_radius);
  } else if (label.kind == DRAPE_DRAW_LABEL_GLYPH) {
    // Blended in linear light, dark text on a light ground would look thin.
    picture.a *= 1.0 - pow(1.0 - texture(glyphs, texture_place).r, 1.8);
  } else if (label.kind == DRAPE_DRAW_LABEL_STRAIN_SCALE) {
    picture.rgb = StrainColour(texture_place.y);
  } else {
    picture.rgb = SpeedColour(texture_place.y);
  }
}
