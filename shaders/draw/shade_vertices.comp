// Before drawing: computes the smooth normal and the shown value of each particle, and for each cloth the extents
// of positions and values and its reach in the directions of a fitted camera. Reads States, Surface, Constraints;
// writes Shaded, Extents. One invocation: one particle (x) of one cloth (y).
#include "draw/cloths.glsl"
#include "draw/constraints.glsl"
#include "lib/float_order.glsl"

layout(local_size_x = LOCAL_SIZE) in;

layout(std430, binding = DRAPE_DRAW_BINDING_SURFACE) readonly buffer Surface {
  uint surface_words[];
};
layout(std430, binding = DRAPE_DRAW_BINDING_SHADED) writeonly buffer Shaded { vec4 shaded[]; };
layout(std430, binding = DRAPE_DRAW_BINDING_EXTENTS) buffer Extents { ClothExtents extents[]; };

layout(std140, binding = DRAPE_DRAW_BINDING_REACHES) uniform Reaches { DrawReaches reaches; };

layout(location = DRAPE_DRAW_UNIFORM_COLOURING) uniform uint colouring;

shared uint lowest[4];
shared uint highest[4];
shared uint farthest[DRAPE_DRAW_REACHES];

// Sum over the triangles of a particle of their normals, each as long as twice its area: large
// triangles count more.
vec3 SmoothNormal(DrawRecord cloth, uint particle, vec3 p) {
  vec3 sum = vec3(0.0);
  uint end = surface_words[cloth.corner_offsets + particle + 1u];
  for (uint k = surface_words[cloth.corner_offsets + particle]; k < end; ++k) {
    uint word = cloth.corners + DRAPE_DRAW_CORNER_WORDS * k;
    vec3 q = LocalPosition(cloth.positions, surface_words[word]);
    vec3 r = LocalPosition(cloth.positions, surface_words[word + 1u]);
    if (IsFinite(q) && IsFinite(r)) sum += cross(q - p, r - p);
  }
  float size = length(sum);
  return size > 0.0 ? sum / size : vec3(0.0);
}

// (l - l0) / l0 of the constraint of the particle where its magnitude is largest [-], with the rest lengths of the
// model; for ropes and struts only the part that their kind forbids.
float LargestStrain(DrawRecord cloth, uint particle, vec3 p) {
  float largest = 0.0;
  uint end = constraint_words[cloth.end_offsets + particle + 1u];
  for (uint k = constraint_words[cloth.end_offsets + particle]; k < end; ++k) {
    uint word = cloth.ends + DRAPE_DRAW_END_WORDS * k;
    uint other = constraint_words[word];
    vec3 q = LocalPosition(cloth.positions, other & DRAPE_DRAW_PARTICLE_BITS);
    float rest_length = uintBitsToFloat(constraint_words[word + 1u]);
    if (!IsFinite(q)) continue;
    float strain = (distance(p, q) - rest_length) / rest_length;
    if ((other & DRAPE_DRAW_KIND_AT_MOST) != 0u) strain = max(strain, 0.0);
    if ((other & DRAPE_DRAW_KIND_AT_LEAST) != 0u) strain = min(strain, 0.0);
    if (abs(strain) > abs(largest)) largest = strain;
  }
  return largest;
}

float Value(DrawRecord cloth, uint particle, vec3 p) {
  if (colouring == DRAPE_DRAW_STRAIN) return LargestStrain(cloth, particle, p);
  if (colouring == DRAPE_DRAW_SIZE) return length(LocalPosition(cloth.velocities, particle));
  return 0.0;
}

void main() {
  uint index = first_cloth + gl_WorkGroupID.y;
  DrawRecord cloth = cloths[index];
  uint lane = gl_LocalInvocationID.x;
  if (lane < DRAPE_DRAW_REACHES) farthest[lane] = 0u;
  if (lane < 4u) {
    lowest[lane] = 0xffffffffu;
    highest[lane] = 0u;
  }
  barrier();
  uint particle = gl_GlobalInvocationID.x;
  if (particle < cloth.particle_count) {
    vec3 p = LocalPosition(cloth.positions, particle);
    if (IsFinite(p)) {
      vec3 normal = cloth.has_surface != 0u ? SmoothNormal(cloth, particle, p) : vec3(0.0);
      float value = Value(cloth, particle, p);
      if (!IsFinite(vec3(value))) value = 0.0;
      shaded[cloth.shaded + particle] = vec4(normal, value);
      vec4 all_of_it = vec4(p, value);
      for (int k = 0; k < 4; ++k) {
        uint bits = OrderedBits(all_of_it[k]);
        atomicMin(lowest[k], bits);
        atomicMax(highest[k], bits);
      }
      for (int k = 0; k < DRAPE_DRAW_REACHES; ++k) {
        atomicMax(farthest[k], OrderedBits(dot(reaches.directions[k].xyz, p)));
      }
    } else {
      shaded[cloth.shaded + particle] = vec4(0.0);
    }
  }
  barrier();
  if (lane == 0u) {
    atomicMin(extents[index].low_x, lowest[0]);
    atomicMin(extents[index].low_y, lowest[1]);
    atomicMin(extents[index].low_z, lowest[2]);
    atomicMin(extents[index].low_value, lowest[3]);
    atomicMax(extents[index].high_x, highest[0]);
    atomicMax(extents[index].high_y, highest[1]);
    atomicMax(extents[index].high_z, highest[2]);
    atomicMax(extents[index].high_value, highest[3]);
  }
  if (lane < DRAPE_DRAW_REACHES) atomicMax(extents[index].reaches[lane], farthest[lane]);
}
