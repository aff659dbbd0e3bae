// Kernel `tiled_find_self_contacts`: stage find_self_contacts, before the prediction of a substep: keeps where it
// begins, searches pairs where the last search is used up, looks at those that may touch, and gives them turns. One
// work group = one cloth; an invocation takes every LOCAL_SIZE-th particle, node, primitive or pair. Reads Models,
// Parameters, Scratch (positions [m], velocities [m/s]); writes Scratch (starts, pairs, turns, and of pins the state
// before), Statuses (contact_pairs,
// most_sweeps).
#define COUNTS_IN_SCRATCH
#define SOLVES_IN_SCRATCH
#include "stages/self_contact_search.glsl"
#include "stages/self_contact_pairs.glsl"

layout(local_size_x = LOCAL_SIZE) in;

layout(location = DRAPE_UNIFORM_SUBSTEP) uniform uint substep_index;

void KeepStarts() {
  CountLoop(cloth.particle_count);
  FOR_EACH(i, 0u, cloth.particle_count) {
    SetStart(i, Position(i));
#ifdef HAS_TWO_STEPS
    // `predict` does so for free particles.
    if (InverseMass(i) == 0.0) SetPrevious(i, Position(i), Velocity(i));
#endif
  }
}

// Whether pair k may touch within the substep, expected to be like the last one.
bool MayTouch(uint k) {
  uint flags = PairFlags(k) & ~(kActive | kHit | kHasPlanes | kCovered | kLands);
  SetPairFlags(k, flags);
  if ((flags & kLeftAlone) != 0u) return false;
  bool are_edges = (flags & kAreEdges) != 0u;
  uvec4 particles = PairParticles(k);
  float touch = PairNumber(kTouchField, k);
  float speed = Length(LargestDifferences(are_edges, Velocities(particles)));
  precise float way = kWayMargin * cloth.step.h * speed + contact.gravity * cloth.step.h * cloth.step.h;
  precise float reach = touch + way;
  if (BoxGap(are_edges, CornersAtStart(particles)) > reach) return false;
  if (!Look(k)) return false;
  return PairNumber(kGapField, k) <= reach;
}

void LookAtPairs() {
  CountLoop(pair_count);
  FOR_EACH(k, 0u, pair_count) {
    if (!MayTouch(k)) continue;
    SetPairFlags(k, PairFlags(k) | kActive);
    AddPending(k);
  }
  EndPhase();
  CountLoop(shared_pending_count * (contact.most_around + 1u));
  FOR_EACH(p, 0u, shared_pending_count) BeginPair(scratch_words[contact.pending + p]);
  EndPhase();
}

void main() {
  OpenCloth(gl_WorkGroupID.y);
  if (substep_index >= cloth.step.substeps) return;
  LoadSelfContacts();
  if (gl_LocalInvocationID.x == 0u) statuses[status_index].most_sweeps = 0u;
  BeginOffers();
  KeepStarts();
  EndPhase();
  if (substep_index == 0u) {
    substeps_left = 0u;
    drift_scale = 1.0;
    given_up = 0u;
  } else {
    LoadContactState();
  }
  EndPhase();
  if (substeps_left == 0u && given_up == uint(DRAPE_CONTACT_MOST_GIVEN_UP)) {
    pair_count = 0u;
    has_all_pairs = false;
    substeps_left = 1u;
  } else if (substeps_left == 0u) {
    SearchAhead(cloth.step.substeps - substep_index);
  } else {
    ++since_search;
  }
  --substeps_left;
  ClearPending();
  if (has_all_pairs) LookAtPairs();
  turn_count = TakeTurns();
  StoreContactState();
}
