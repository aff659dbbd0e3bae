// Stage `solve_hinges`: stage by stage the impulses of the hinges, from where the particles will be at the velocities
// so far, then the changes of the velocities. Needs the accessors of one plan.
#include "stages/apply_elastic.glsl"

// How long forces act on u [s].
float HingeForceTime() { return IsTwoStep() ? substep.kick_within : substep.interval; }

// Shared forces are found per second.
void StoreHingeImpulse(uint e) {
  if (!finds_hinges) return;
  StoreElasticImpulse(e, DRAPE_KICK_HINGES, cloth.hinge_period > 1u ? 1.0 : HingeForceTime());
}

#ifdef HAS_IMPULSES
// What is held: the impulses in place of the changes.
void PullByHinges(uint i, uint stage) {
  uint word = cloth.scratch.hinge_changes + 3u * i;
  if (cloth.hinge_period > 1u) {
    if (finds_hinges) SetScratchVector(word, ImpulseOfElements(i));
    precise vec3 shared_impulse = HingeForceTime() * ScratchVector(word);
    Pull(i, shared_impulse);
    return;
  }
  uint numbers = cloth.parameters.hinge_stages + 2u * stage;
  precise vec3 impulse = Parameter(numbers + 1u) * ImpulseOfElements(i);
  if (stage > 0u) impulse = Parameter(numbers) * ScratchVector(word) + impulse;
  SetScratchVector(word, impulse);
  Pull(i, impulse);
}
#endif

void ApplySharedHinges(uint i) {
  uint word = cloth.scratch.hinge_changes + 3u * i;
  if (finds_hinges) SetScratchVector(word, ChangeByElements(i));
  SetVelocity(i, AddScaled(Velocity(i), HingeForceTime(), ScratchVector(word)));
}

void ApplyHinges(uint i, uint stage) {
#ifdef HAS_IMPULSES
  if (InverseMass(i) == 0.0) PullByHinges(i, stage);
#endif
  if (InverseMass(i) == 0.0) return;
  if (cloth.hinge_period > 1u) {
    ApplySharedHinges(i);
    return;
  }
  uint numbers = cloth.parameters.hinge_stages + 2u * stage;
  uint word = cloth.scratch.hinge_changes + 3u * i;
  precise vec3 change = Parameter(numbers + 1u) * ChangeByElements(i);
  if (stage > 0u) change = Parameter(numbers) * ScratchVector(word) + change;
  SetScratchVector(word, change);
  SetVelocity(i, AddScaled(Velocity(i), 1.0, change));
}
