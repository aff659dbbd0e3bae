// What is added up before and after a step that tells impulses, of cloths of all variants.
#include "stages/impulses.glsl"

// The particle of pin or grip k.
uint HeldParticle(uint k) {
  return cloth.has_grips != 0u ? parameters[cloth.parameters.held + k] : models[cloth.model.pins + k];
}

// Of an open grip 0.
vec3 HeldVelocity(uint i) {
  if (i == DRAPE_NO_PARTICLE) return vec3(0.0);
  return StateVector(cloth.velocities + 3u * i);
}

uint PieceWords() { return 6u * cloth.pin_count + 12u * cloth.collider_count; }
uint PieceWord(uint piece) { return ImpulseWord(DRAPE_IMPULSE_RESULTS) + PieceWords() * piece; }
uint HeldWord(uint k) { return PieceWord(cloth.measure_piece_count) + DRAPE_IMPULSE_HELD_WORDS * k; }
