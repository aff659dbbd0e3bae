// Kernel `impulses_total`: after a step that tells impulses: adds up those of one piece of a cloth (DRAPE_MEASURE_PIECE
// particles, and a share of the links of what is held), in an order that does not depend on the local size. Work group
// x = piece, y = cloth. Reads Scratch (sums), States, Models; writes Scratch (lanes, results [N s, N m s]).
#define HAS_IMPULSES  // of cloths of all variants
#define COUNTS_IN_SCRATCH
#define SOLVES_IN_SCRATCH
#include "stages/impulse_results.glsl"
#include "lib/compensated_sum.glsl"

layout(local_size_x = LOCAL_SIZE) in;

void EndPhase() {
  memoryBarrierBuffer();
  barrier();
}

struct VectorSum {
  vec2 x;
  vec2 y;
  vec2 z;
};
VectorSum NoSum() { return VectorSum(vec2(0.0), vec2(0.0), vec2(0.0)); }
void AddVector(inout VectorSum sum, vec3 vector) {
  sum.x = AddCompensated(sum.x, vector.x);
  sum.y = AddCompensated(sum.y, vector.y);
  sum.z = AddCompensated(sum.z, vector.z);
}

// Of six numbers of a collider.
uint LaneWord(uint piece, uint c, uint number, uint lane) {
  uint sum = ((piece * cloth.collider_count + c) * 6u + number) * DRAPE_IMPULSE_LANE_COUNT + lane;
  return ImpulseWord(DRAPE_IMPULSE_LANES) + 2u * sum;
}
void StoreLane(uint word, vec2 sum) {
  scratch_words[word] = floatBitsToUint(sum.x);
  scratch_words[word + 1u] = floatBitsToUint(sum.y);
}

void AddUpLane(uint piece, uint c, uint lane) {
  uint end = min((piece + 1u) * DRAPE_MEASURE_PIECE, cloth.particle_count);
  VectorSum impulse = NoSum();
  VectorSum moment = NoSum();
  for (uint i = piece * DRAPE_MEASURE_PIECE + lane; i < end; i += DRAPE_IMPULSE_LANE_COUNT) {
    uint word = ImpulseWord(DRAPE_IMPULSE_CONTACTS) + 6u * (c * cloth.particle_count + i);
    AddVector(impulse, ScratchVector(word));
    AddVector(moment, ScratchVector(word + 3u));
  }
  StoreLane(LaneWord(piece, c, 0u, lane), impulse.x);
  StoreLane(LaneWord(piece, c, 1u, lane), impulse.y);
  StoreLane(LaneWord(piece, c, 2u, lane), impulse.z);
  StoreLane(LaneWord(piece, c, 3u, lane), moment.x);
  StoreLane(LaneWord(piece, c, 4u, lane), moment.y);
  StoreLane(LaneWord(piece, c, 5u, lane), moment.z);
}

void AddUpLanes(uint piece, uint c, uint number) {
  vec2 sum = vec2(0.0);
  for (uint lane = 0u; lane < DRAPE_IMPULSE_LANE_COUNT; ++lane) {
    uint word = LaneWord(piece, c, number, lane);
    sum = AddCompensated(sum, uintBitsToFloat(scratch_words[word]));
    sum = AddCompensated(sum, uintBitsToFloat(scratch_words[word + 1u]));
  }
  uint word = PieceWord(piece) + 6u * cloth.pin_count + 12u * c + number;
  scratch_words[word] = floatBitsToUint(sum.x);
  scratch_words[word + 6u] = floatBitsToUint(sum.y);
}

// A share of the links of what is held.
void AddUpHeld(uint piece, uint k) {
  uint i = HeldParticle(k);
  VectorSum sum = NoSum();
  if (i != DRAPE_NO_PARTICLE) {
    uint offset = ImpulseWord(DRAPE_IMPULSE_LIST_OFFSETS) + i;
    uint begin = models[offset];
    uint count = models[offset + 1u] - begin;
    uint share = (count + cloth.measure_piece_count - 1u) / cloth.measure_piece_count;
    uint end = begin + min(share * (piece + 1u), count);
    for (uint place = begin + min(share * piece, count); place < end; ++place) {
      uint entry = models[ImpulseWord(DRAPE_IMPULSE_LISTS) + place];
      vec3 vector = ScratchVector(ImpulseWord(DRAPE_IMPULSE_VECTORS) + 3u * (entry >> 1));
      AddVector(sum, (entry & 1u) != 0u ? -vector : vector);
    }
    if (piece == 0u) AddVector(sum, ScratchVector(ImpulseWord(DRAPE_IMPULSE_PULLS) + 3u * i));
  }
  uint word = PieceWord(piece) + 6u * k;
  SetScratchVector(word, vec3(sum.x.x, sum.y.x, sum.z.x));
  SetScratchVector(word + 3u, vec3(sum.x.y, sum.y.y, sum.z.y));
}

void TellHeld(uint k) {
  uint i = HeldParticle(k);
  bool has_exact = ImpulseWord(DRAPE_IMPULSE_HAS_EXACT) != 0u && i != DRAPE_NO_PARTICLE;
  SetScratchVector(HeldWord(k) + 3u, HeldVelocity(i));
  for (uint n = 0u; n < DRAPE_EXACT_WORDS; ++n) {
    uint word = 0u;
    if (has_exact) {
      word = scratch_words[ImpulseWord(DRAPE_IMPULSE_EXACT_PULLS) + DRAPE_EXACT_WORDS * i + n];
    }
    scratch_words[HeldWord(k) + 6u + n] = word;
  }
}

void main() {
  OpenRecord(items[first_item + gl_WorkGroupID.y].cloth);
  uint piece = gl_WorkGroupID.x;
  if (piece >= cloth.measure_piece_count) return;
  uint lanes = DRAPE_IMPULSE_LANE_COUNT * cloth.collider_count;
  for (uint lane = gl_LocalInvocationID.x; lane < lanes; lane += LOCAL_SIZE) {
    AddUpLane(piece, lane / DRAPE_IMPULSE_LANE_COUNT, lane % DRAPE_IMPULSE_LANE_COUNT);
  }
  EndPhase();
  for (uint n = gl_LocalInvocationID.x; n < 6u * cloth.collider_count; n += LOCAL_SIZE) {
    AddUpLanes(piece, n / 6u, n % 6u);
  }
  for (uint k = gl_LocalInvocationID.x; k < cloth.pin_count; k += LOCAL_SIZE) {
    AddUpHeld(piece, k);
    if (piece == 0u) TellHeld(k);
  }
}
