// The rectangles of the legend. One instance: a rectangle.
#include "draw/frame.glsl"

layout(std430, binding = DRAPE_DRAW_BINDING_INSTANCES) readonly buffer Labels {
  LabelRecord labels[];
};
layout(location = DRAPE_DRAW_UNIFORM_FIRST_INSTANCE) uniform uint first_instance;

layout(location = 0) out vec2 texture_place;
layout(location = 1) out vec2 pixel;
layout(location = 2) flat out uint label_index;

const vec2 kCorners[6] = vec2[](vec2(0, 0), vec2(1, 0), vec2(1, 1), vec2(0, 0), vec2(1, 1), vec2(0, 1));

void main() {
  label_index = first_instance + uint(gl_InstanceID);
  LabelRecord label = labels[label_index];
  vec2 corner = kCorners[gl_VertexID];
  pixel = mix(label.box.xy, label.box.zw, corner);
  texture_place = mix(label.texture.xy, label.texture.zw, corner);
  vec2 clip = 2.0 * pixel / frame.screen.xy - 1.0;
  gl_Position = vec4(clip.x, -clip.y, 0.0, 1.0);
}
