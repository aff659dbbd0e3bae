// The colours of the two sides of each particle, for cloths whose cells are a few pixels wide: between particles they
// are interpolated (lit_cloth). Each particle is lit once, where a pixel would be once for each triangle that touches
// the four pixels around it. One invocation: a particle (x) of a cloth (y).
#define LIT_ACCESS writeonly
#include "draw/cloths.glsl"
#include "draw/cloth_colour.glsl"
#include "draw/lit.glsl"
#include "draw/picture.glsl"
#include "draw/shaded.glsl"

layout(local_size_x = LOCAL_SIZE) in;

void main() {
  DrawRecord cloth = cloths[first_cloth + gl_WorkGroupID.y];
  uint particle = gl_GlobalInvocationID.x;
  if (particle >= cloth.particle_count) return;
  vec3 p = LocalPosition(cloth.positions, particle);
  vec4 shade = shaded[cloth.shaded + particle];
  vec3 position = (IsFinite(p) ? p : vec3(0.0)) + cloth.offset.xyz;
  vec3 front = Opaque(ClothColour(position, shade.xyz, true, shade.w, cloth.colour.rgb)).rgb;
  vec3 back = Opaque(ClothColour(position, shade.xyz, false, shade.w, cloth.colour.rgb)).rgb;
  uint word = DRAPE_DRAW_LIT_WORDS * (cloth.shaded + particle);
  lit[word] = packUnorm2x16(front.rg);
  lit[word + 1u] = packUnorm2x16(vec2(front.b, back.r));
  lit[word + 2u] = packUnorm2x16(back.gb);
}
