// The strips of a phase by lanes, as SolveLane of reduce_strips.glsl or reduce_quads.glsl does. Needs one of them.
#ifndef DRAPE_STAGES_SOLVE_LANES_GLSL_
#define DRAPE_STAGES_SOLVE_LANES_GLSL_

#ifdef KEEPS_LANES
// Two phases at most, in one round each.
LaneSlotWords kept_lane_first;
LaneSlotWords kept_lane_second;

LaneSlotWords LoadKeptLane(uint phase) {
  LaneSlotWords words = NoLane();
  if (phase < cloth.strip_phase_count) {
    uint slot = models[cloth.model.strip_phase_lanes + phase] + LaneSlot();
    if (slot < models[cloth.model.strip_phase_lanes + phase + 1u]) words = LoadLaneSlot(slot);
  }
  return WithPins(words);
}

// The barrier is for compilers: after it they know that subgroups are together, and need not see to it at each exchange.
void KeepLanes() {
  kept_lane_first = LoadKeptLane(0u);
  kept_lane_second = LoadKeptLane(1u);
  PhaseBarrier();
}

void ReduceStrips(uint phase, bool is_first_sweep) {
  // Many subgroups have nothing to do.
  if (!HasAnyLane(phase == 1u ? HasWork(kept_lane_second) : HasWork(kept_lane_first))) return;
  LaneSlotWords words = kept_lane_first;
  if (phase == 1u) words = kept_lane_second;
  SolveLane(words, is_first_sweep);
}
#else
// As many at a time as there are lanes.
void ReduceStrips(uint phase, bool is_first_sweep) {
  uint end = models[cloth.model.strip_phase_lanes + phase + 1u];
  for (uint first = models[cloth.model.strip_phase_lanes + phase]; first < end; first += LaneCount()) {
    LaneSlotWords words = NoLane();
    uint slot = first + LaneSlot();
    if (LaneSlot() < LaneCount() && slot < end) words = LoadLaneSlot(slot);
    if (HasAnyLane(HasWork(words))) SolveLane(words, is_first_sweep);
  }
}
#endif

#endif
