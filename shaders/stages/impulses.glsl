// What the step gives to what is held and to colliders (server/solver/method.md, "Impulses"): sums of the impulses on
// particles, times the weight of the substep. Each place has one writer in a phase.
#ifndef DRAPE_STAGES_IMPULSES_GLSL_
#define DRAPE_STAGES_IMPULSES_GLSL_

#include "interface/impulse_record.h"
#include "lib/vector.glsl"
#include "stages/buffers.glsl"

#ifdef HAS_IMPULSES
uint ImpulseWord(uint member) { return parameters[cloth.impulses + member]; }

// Of the substep under way.
float impulse_weight;
float memory_weight;

void BeginImpulses(uint substep) {
  uint word = ImpulseWord(DRAPE_IMPULSE_WEIGHTS) + 2u * substep;
  impulse_weight = Parameter(word);
  memory_weight = Parameter(word + 1u);
}

void AddImpulse(uint word, float weight, vec3 impulse) {
  SetScratchVector(word, AddScaled(ScratchVector(word), weight, impulse));
}

// On particle i, which is held, by the invocation that would move it [N s].
void Pull(uint i, vec3 impulse) { AddImpulse(ImpulseWord(DRAPE_IMPULSE_PULLS) + 3u * i, impulse_weight, impulse); }

// Of a link: whether one end of it is held.
bool PullsOnHeld(float inverse_mass_i, float inverse_mass_j) {
  return (inverse_mass_i == 0.0) != (inverse_mass_j == 0.0);
}
// By constraint k, on its second particle, and the opposite on its first one; PullsOnHeld.
void PullAtConstraint(uint k, vec3 impulse) {
  AddImpulse(ImpulseWord(DRAPE_IMPULSE_VECTORS) + 3u * k, impulse_weight, impulse);
}
void PullAtJoint(uint k, vec3 impulse) { PullAtConstraint(cloth.constraint_count + k, impulse); }
// By tether t, on its pin.
void PullAtTether(uint t, vec3 impulse) { PullAtJoint(cloth.joint_count + t, impulse); }

// By collider c, whose pivot is there, on particle i: a change of its velocity [m/s] at `place`, where it is when the
// substep ends.
void PushBy(uint c, vec3 pivot, uint i, vec3 place, float weight, vec3 change) {
  if (change == vec3(0.0)) return;
  uint word = ImpulseWord(DRAPE_IMPULSE_CONTACTS) + 6u * (c * cloth.particle_count + i);
  precise vec3 impulse = ModelFloat(cloth.model.masses + i) * change;
  precise vec3 lever = place - pivot;
  AddImpulse(word, weight, impulse);
  AddImpulse(word + 3u, weight, Cross(lever, impulse));
}
#endif
#endif
