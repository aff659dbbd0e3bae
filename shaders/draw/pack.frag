// The pixels of a tile from their samples, as they are read: colours before the backdrop, a gradient from the bottom to
// the top, averaged in linear light; the distance along the line of view at one sample.
#include "draw/frame.glsl"
#include "lib/srgb.glsl"

#if SAMPLES == 1
layout(binding = DRAPE_DRAW_UNIT_COLOURS) uniform sampler2D colours;  // as they are stored
layout(binding = DRAPE_DRAW_UNIT_DEPTHS) uniform sampler2D depths;
#else
layout(binding = DRAPE_DRAW_UNIT_COLOURS) uniform sampler2DMS colours;
layout(binding = DRAPE_DRAW_UNIT_DEPTHS) uniform sampler2DMS depths;
#endif
layout(location = DRAPE_DRAW_UNIFORM_ROWS) uniform uint rows;  // of the images

layout(location = 0) in float height;
layout(location = 0) out vec4 picture;
layout(location = 1) out float depth_m;

vec3 Backdrop() {
  const vec3 bottom = vec3(0.58, 0.63, 0.69);
  const vec3 top = vec3(0.90, 0.925, 0.95);
  return mix(bottom, top, smoothstep(0.0, 0.9, height));
}

void main() {
  ivec2 pixel = ivec2(int(gl_FragCoord.x), int(rows) - 1 - int(gl_FragCoord.y));
  vec4 first = texelFetch(colours, pixel, 0);
  bool is_uniform = true;
  vec4 light = vec4(NearLinearFromSrgb(first.rgb), first.a);
  for (int k = 1; k < SAMPLES; ++k) {
    vec4 other = texelFetch(colours, pixel, k);
    is_uniform = is_uniform && other == first;
    light += vec4(NearLinearFromSrgb(other.rgb), other.a);
  }
  light /= float(SAMPLES);
  vec3 mixed = SrgbFromLinear(min(light.rgb + (1.0 - light.a) * Backdrop(), 1.0));
  picture = vec4(is_uniform && first.a == 1.0 ? first.rgb : mixed, 1.0);
  float depth = texelFetch(depths, pixel, 0).r;
  // frame.scale.w: depth times distance (ClipFromEye); infinity: nothing is there.
  depth_m = depth > 0.0 ? frame.scale.w / depth : uintBitsToFloat(0x7f800000u);
}
