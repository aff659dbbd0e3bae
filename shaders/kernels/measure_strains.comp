// Kernel `measure_strains`: stage measure, percentiles of the strain of the committed state. The links are
// counted in bins; counts do not depend on the order of the invocations. Work group = cloth. Reads States,
// Models, Parameters; writes Statuses.
#include "stages/committed_link.glsl"
#include "lib/strain_bins.glsl"

layout(local_size_x = LOCAL_SIZE) in;

const uint kBinsEach = STRAIN_BINS / LOCAL_SIZE;

shared uint links_by_bin[STRAIN_BINS];
shared uint links_by_invocation[LOCAL_SIZE];  // in the bins of each

void CountLinks() {
  uint lane = gl_LocalInvocationID.x;
  for (uint bin = lane; bin < STRAIN_BINS; bin += LOCAL_SIZE) links_by_bin[bin] = 0u;
  memoryBarrierShared();
  barrier();
  for (uint k = lane; k < cloth.constraint_count; k += LOCAL_SIZE) {
    atomicAdd(links_by_bin[BinOfStrain(LoadCommittedLink(k).strain)], 1u);
  }
  memoryBarrierShared();
  barrier();
}

// The links in all bins before those of this invocation.
uint LinksBelow() {
  uint lane = gl_LocalInvocationID.x;
  uint links = 0u;
  for (uint bin = lane * kBinsEach; bin < (lane + 1u) * kBinsEach; ++bin) links += links_by_bin[bin];
  links_by_invocation[lane] = links;
  memoryBarrierShared();
  barrier();
  uint below = 0u;
  for (uint other = 0u; other < lane; ++other) below += links_by_invocation[other];
  return below;
}

// `below`, `up_to`: the links in the bins before it, and with its own. Bin 0 has rank 0, of no links.
bool IsInBin(uint rank, uint bin, uint below, uint up_to) {
  return rank <= up_to && (below < rank || bin == 0u);
}

void main() {
  BatchItem item = items[first_item + gl_WorkGroupID.x];
  OpenRecord(item.cloth);
  CountLinks();
  uint below = LinksBelow();
  uint p50_rank = NearestRank(cloth.constraint_count, 50u);
  uint p90_rank = NearestRank(cloth.constraint_count, 90u);
  uint p99_rank = NearestRank(cloth.constraint_count, 99u);
  uint begin = gl_LocalInvocationID.x * kBinsEach;
  for (uint bin = begin; bin < begin + kBinsEach; ++bin) {
    uint up_to = below + links_by_bin[bin];
    float strain = StrainOfBin(bin);
    if (IsInBin(p50_rank, bin, below, up_to)) statuses[item.status].strain_p50 = strain;
    if (IsInBin(p90_rank, bin, below, up_to)) statuses[item.status].strain_p90 = strain;
    if (IsInBin(p99_rank, bin, below, up_to)) statuses[item.status].strain_p99 = strain;
    below = up_to;
  }
}
