// Kernel `impulses_begin`: before a step that tells impulses: its sums are 0; keeps the velocities of what is held. Work
// group x = DRAPE_IMPULSE_CLEARED_WORDS words, y = cloth. Reads States; writes Scratch.
#define HAS_IMPULSES  // of cloths of all variants
#define COUNTS_IN_SCRATCH
#include "stages/impulse_results.glsl"

layout(local_size_x = LOCAL_SIZE) in;

void main() {
  OpenRecord(items[first_item + gl_WorkGroupID.y].cloth);
  uint begin = ImpulseWord(DRAPE_IMPULSE_PULLS) + DRAPE_IMPULSE_CLEARED_WORDS * gl_WorkGroupID.x;
  uint end = min(begin + DRAPE_IMPULSE_CLEARED_WORDS, ImpulseWord(DRAPE_IMPULSE_SUMS_END));
  for (uint word = begin + gl_LocalInvocationID.x; word < end; word += LOCAL_SIZE) scratch_words[word] = 0u;
  if (gl_WorkGroupID.x != 0u) return;
  for (uint k = gl_LocalInvocationID.x; k < cloth.pin_count; k += LOCAL_SIZE) {
    SetScratchVector(HeldWord(k), HeldVelocity(HeldParticle(k)));
  }
}
