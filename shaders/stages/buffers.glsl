// The storage blocks of all kernels but `pack`, and the loads and stores that both plans share.
#ifndef DRAPE_STAGES_BUFFERS_GLSL_
#define DRAPE_STAGES_BUFFERS_GLSL_

#include "interface/bindings.h"
#include "interface/batch_item.h"
#include "interface/cloth_record.h"
#include "interface/cloth_status.h"
#include "interface/dispatch_args.h"
#include "lib/contact.glsl"

layout(std430, binding = DRAPE_BINDING_ITEMS) restrict readonly buffer Items {
  BatchItem items[];
};
layout(std430, binding = DRAPE_BINDING_CLOTHS) restrict readonly buffer Cloths {
  ClothRecord cloths[];
};
layout(std430, binding = DRAPE_BINDING_MODELS) restrict readonly buffer Models {
  uint models[];
};
layout(std430, binding = DRAPE_BINDING_STATES) restrict buffer States {
  float states[];
};
layout(std430, binding = DRAPE_BINDING_PARAMETERS) restrict readonly buffer Parameters {
  uint parameters[];
};
// In `apply_wind`, `apply_elastic`, `solve_elastic` and `solve_hinges` of the resident plan invocations read values
// that others of their work group have written here, and so do those that tell impulses in every phase;
// SOLVES_IN_SCRATCH: a kernel of the tiled plan that has phases.
#if defined(HAS_APPLY_WIND) || defined(HAS_APPLY_ELASTIC) || defined(HAS_SOLVE_ELASTIC) || \
    defined(HAS_SOLVE_HINGES) || defined(HAS_IMPULSES) || defined(SOLVES_IN_SCRATCH)
#define SCRATCH_MEMORY coherent
#else
#define SCRATCH_MEMORY
#endif
// COUNTS_IN_SCRATCH: a kernel that has atomics in it sees floats by their bits.
layout(std430, binding = DRAPE_BINDING_SCRATCH) restrict SCRATCH_MEMORY buffer Scratch {
#ifdef COUNTS_IN_SCRATCH
  uint scratch_words[];
#else
  float scratch[];
#endif
};
layout(std430, binding = DRAPE_BINDING_STATUSES) restrict buffer Statuses {
  ClothStatus statuses[];
};
layout(std430, binding = DRAPE_BINDING_DISPATCHES) restrict buffer Dispatches {
  DispatchArgs dispatches[];
};

layout(location = DRAPE_UNIFORM_FIRST_ITEM) uniform uint first_item;

// The cloth this invocation works on, and its place in Cloths; main begins with OpenRecord.
#ifdef SHARES_RECORD
// One for the work group: in registers of each invocation it would leave no room for more groups.
shared ClothRecord cloth;
#else
ClothRecord cloth;
#endif
uint cloth_slot;

// In uniform control flow.
void OpenRecord(uint slot) {
  cloth_slot = slot;
#ifdef SHARES_RECORD
  if (gl_LocalInvocationID.x == 0u) cloth = cloths[slot];
  memoryBarrierShared();
  barrier();
#else
  cloth = cloths[slot];
#endif
}

float ModelFloat(uint word) { return uintBitsToFloat(models[word]); }
float Parameter(uint word) { return uintBitsToFloat(parameters[word]); }

vec3 StateVector(uint word) { return vec3(states[word], states[word + 1u], states[word + 2u]); }
void SetStateVector(uint word, vec3 value) {
  states[word] = value.x;
  states[word + 1u] = value.y;
  states[word + 2u] = value.z;
}

#ifdef COUNTS_IN_SCRATCH
vec3 ScratchVector(uint word) {
  return uintBitsToFloat(
      uvec3(scratch_words[word], scratch_words[word + 1u], scratch_words[word + 2u]));
}
void SetScratchVector(uint word, vec3 value) {
  scratch_words[word] = floatBitsToUint(value.x);
  scratch_words[word + 1u] = floatBitsToUint(value.y);
  scratch_words[word + 2u] = floatBitsToUint(value.z);
}
#else
vec3 ScratchVector(uint word) { return vec3(scratch[word], scratch[word + 1u], scratch[word + 2u]); }
void SetScratchVector(uint word, vec3 value) {
  scratch[word] = value.x;
  scratch[word + 1u] = value.y;
  scratch[word + 2u] = value.z;
}
#endif

vec3 ParameterVector(uint word) {
  return vec3(Parameter(word), Parameter(word + 1u), Parameter(word + 2u));
}

vec3 PinTarget(uint k) { return ParameterVector(cloth.parameters.pin_targets + 3u * k); }

// The particle of pin k, or of a grip, which may be none.
#ifdef HAS_GRIPS
uint PinParticle(uint k) { return parameters[cloth.parameters.held + k]; }
bool IsOpen(uint pin_particle) { return pin_particle == DRAPE_NO_PARTICLE; }
float HeldInverseMass(uint i) { return Parameter(cloth.parameters.inverse_masses + i); }
#else
uint PinParticle(uint k) { return models[cloth.model.pins + k]; }
bool IsOpen(uint pin_particle) { return false; }
float HeldInverseMass(uint i) { return ModelFloat(cloth.model.inverse_masses + i); }
#endif

#ifdef HAS_DISTANCE_MAP
// `map`: the map's place in Models; 0 for colliders of other shapes, for which the result is meaningless.
DistanceGrid LoadGrid(uint map) {
  return DistanceGrid(uvec3(models[map], models[map + 1u], models[map + 2u]), ModelFloat(map + 3u),
                      ModelFloat(map + 4u), map + DRAPE_MAP_HEADER_WORDS);
}
#endif

Collider LoadCollider(uint c) {
  uint word = cloth.parameters.colliders + DRAPE_COLLIDER_WORDS * c;
  Collider collider;
  collider.kind = parameters[word];
  collider.radius = Parameter(word + 1u);
  collider.point = ParameterVector(word + 2u);
  collider.vector = ParameterVector(word + 5u);
  collider.axes = mat3(ParameterVector(word + 8u), ParameterVector(word + 11u),
                       ParameterVector(word + 14u));
#ifdef HAS_DISTANCE_MAP
  collider.grid = LoadGrid(parameters[word + 17u]);
#endif
  return collider;
}

#ifdef HAS_DISTANCE_MAP
CellCorners LoadCorners(DistanceGrid grid, uvec3 cell) {
  uint row = grid.sample_counts.x;
  uint layer = row * grid.sample_counts.y;
  uint near_z = grid.samples + cell.z * layer + cell.y * row + cell.x;
  uint far_z = near_z + layer;
  return CellCorners(vec4(ModelFloat(near_z), ModelFloat(near_z + 1u), ModelFloat(near_z + row),
                          ModelFloat(near_z + row + 1u)),
                     vec4(ModelFloat(far_z), ModelFloat(far_z + 1u), ModelFloat(far_z + row),
                          ModelFloat(far_z + row + 1u)));
}
#endif

// Gap and outward normal at q, of any shape.
Gap ColliderGap(Collider collider, float thickness, vec3 q) {
#ifdef HAS_DISTANCE_MAP
  if (collider.kind == COLLIDER_DISTANCE_MAP) {
    precise vec3 from_corner = q - collider.point;
    MapPlace place = PlaceInMap(collider.grid, collider.axes, from_corner);
    return DistanceMapGap(collider, thickness, place, LoadCorners(collider.grid, place.cell));
  }
#endif
  return ShapeGap(collider, thickness, q);
}

#endif
