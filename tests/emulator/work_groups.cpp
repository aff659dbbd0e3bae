#include "tests/emulator/work_groups.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "server/core/check.h"

namespace drape::emulator {

void WorkGroups::OpenRegions(const KernelEntry& kernel, const Dispatch& dispatch,
                             const RunOptions& options) {
  result_ = {.blocks = dispatch.blocks, .findings = {}};
  regions_.clear();
  last_region_ = 0;
  std::vector<BlockInfo> blocks;
  std::vector<BlockInfo> shared;
  std::vector<UniformInfo> uniforms;
  kernel.set_up(this, &arithmetic_, options.local_size);
  kernel.describe(blocks, shared, uniforms);
  for (const UniformInfo& uniform : uniforms) {
    *uniform.value = dispatch.uniforms.at(uniform.location);
  }
  for (const BlockInfo& info : blocks) {
    std::vector<uint32_t>& words = result_.blocks.at(info.binding);
    DRAPE_CHECK(!words.empty(), std::string("nothing is bound to ") + info.name);
    regions_.push_back({.info = info,
                        .words = words.data(),
                        .word_count = words.size(),
                        .log = AccessLog(words.size())});
  }
  size_t shared_words = 0;
  for (const BlockInfo& info : shared) shared_words += info.count * info.element_bytes / 4;
  constexpr size_t kAlignment = 4;  // words of a vec4
  shared_.assign(shared_words + kAlignment * shared.size() + kAlignment, kUnwritten);
  size_t offset = 0;
  for (const BlockInfo& info : shared) {
    const size_t count = info.count * info.element_bytes / 4;
    regions_.push_back({.info = info,
                        .kind = MemoryKind::kShared,
                        .words = shared_.data() + offset,
                        .word_count = count,
                        .log = AccessLog(count)});
    offset += (count + kAlignment - 1) / kAlignment * kAlignment;
  }
  for (const Region& region : regions_) {
    region.info.block->bytes = reinterpret_cast<std::byte*>(region.words);
    region.info.block->count =
        static_cast<uint32_t>(region.word_count * 4 / region.info.element_bytes);
  }
}

RunResult WorkGroups::Run(const KernelEntry& kernel, const Dispatch& dispatch,
                          const RunOptions& options) {
  random_.seed(options.seed);
  arithmetic_ = options.arithmetic;
  local_size_ = options.local_size;
  group_count_ = dispatch.group_count;
  OpenRegions(kernel, dispatch, options);
  std::vector<std::array<uint32_t, 3>> groups;
  for (uint32_t z = 0; z < group_count_[2]; ++z) {
    for (uint32_t y = 0; y < group_count_[1]; ++y) {
      for (uint32_t x = 0; x < group_count_[0]; ++x) groups.push_back({x, y, z});
    }
  }
  std::shuffle(groups.begin(), groups.end(), random_);
  group_ = 0;
  for (const auto& group : groups) RunGroup(kernel, group);
  return std::move(result_);
}

void WorkGroups::RunGroup(const KernelEntry& kernel, const std::array<uint32_t, 3>& group) {
  ++group_;
  epoch_ = 0;
  std::fill(shared_.begin(), shared_.end(), kUnwritten);
  for (Region& region : regions_) {  // each work group has shared memory of its own
    if (region.kind == MemoryKind::kShared) region.log = AccessLog(region.word_count);
  }
  invocations_.assign(local_size_, {});
  subgroup_epochs_.assign((local_size_ + kSubgroupSize - 1) / kSubgroupSize, 0);
  fibers_.Begin(local_size_, [&](uint32_t k) {
    Ids ids{.local = k, .local_size = local_size_};
    std::copy(group.begin(), group.end(), ids.group);
    std::copy(group_count_.begin(), group_count_.end(), ids.group_count);
    kernel.run(ids);
  });
  while (true) {
    RunReady();
    bool has_ended = true;
    for (uint32_t k = 0; k < local_size_; ++k) has_ended = has_ended && fibers_.has_ended(k);
    if (has_ended) return;
    Release();
  }
}

void WorkGroups::RunReady() {
  std::vector<uint32_t> ready;
  for (uint32_t k = 0; k < local_size_; ++k) {
    if (!fibers_.has_ended(k) && invocations_[k].waiting.what == Waiting::For::kNothing) {
      ready.push_back(k);
    }
  }
  std::shuffle(ready.begin(), ready.end(), random_);
  for (const uint32_t k : ready) {
    current_ = k;
    first_frame = invocations_[k].first_frame;
    fibers_.Run(k);
    invocations_[k].first_frame = first_frame;
  }
}

void WorkGroups::WaitFor(const Waiting& waiting) {
  invocations_[current_].waiting = waiting;
  fibers_.Wait();
}

// Nothing can run: subgroups that met go on, else the work group.
void WorkGroups::Release() {
  bool is_released = false;
  for (uint32_t first = 0; first < local_size_; first += kSubgroupSize) {
    if (ReleaseSubgroup(first, std::min(first + kSubgroupSize, local_size_))) is_released = true;
  }
  if (!is_released) ReleaseGroup();
}

bool WorkGroups::ReleaseSubgroup(uint32_t first, uint32_t end) {
  std::vector<uint32_t> members;
  bool is_uniform = true;
  for (uint32_t k = first; k < end; ++k) {
    const Waiting& waiting = invocations_[k].waiting;
    const bool waits_here = !fibers_.has_ended(k) && waiting.what != Waiting::For::kGroup;
    if (waits_here &&
        (members.empty() || waiting.call_stack == invocations_[members[0]].waiting.call_stack)) {
      members.push_back(k);
    } else {
      is_uniform = false;
    }
  }
  if (members.empty()) return false;
  const Waiting& waiting = invocations_[members[0]].waiting;
  if (!is_uniform && waiting.what == Waiting::For::kSubgroup) {
    result_.findings.Add(Fault::kBarrier, waiting.place, nullptr,
                         "a part of a subgroup waits at a barrier of the subgroup");
  }
  if (waiting.what == Waiting::For::kShuffle) Exchange(members, first);
  for (const uint32_t k : members) invocations_[k].waiting = {};
  ++subgroup_epochs_[first / kSubgroupSize];
  return true;
}

void WorkGroups::Exchange(const std::vector<uint32_t>& members, uint32_t first) {
  std::vector<std::vector<uint32_t>> offers(kSubgroupSize);
  for (const uint32_t k : members) {
    const Waiting& waiting = invocations_[k].waiting;
    offers[k - first].assign(waiting.words, waiting.words + waiting.count);
  }
  for (const uint32_t k : members) {
    const Waiting& waiting = invocations_[k].waiting;
    if (waiting.lane < kSubgroupSize && !offers[waiting.lane].empty()) {
      std::copy(offers[waiting.lane].begin(), offers[waiting.lane].end(), waiting.words);
      continue;
    }
    result_.findings.Add(
        Fault::kInactiveLane, waiting.place, nullptr,
        "lane " + std::to_string(k - first) + " asks lane " + std::to_string(waiting.lane));
    std::fill(waiting.words, waiting.words + waiting.count, kUnwritten);
  }
}

void WorkGroups::ReleaseGroup() {
  const Invocation* first = nullptr;
  for (uint32_t k = 0; k < local_size_; ++k) {
    if (!fibers_.has_ended(k) && first == nullptr) first = &invocations_[k];
  }
  for (uint32_t k = 0; k < local_size_; ++k) {
    const Waiting& waiting = invocations_[k].waiting;
    if (fibers_.has_ended(k)) {
      result_.findings.Add(Fault::kBarrier, first->waiting.place, nullptr,
                           "invocation " + std::to_string(k) + " has ended");
    } else if (waiting.call_stack != first->waiting.call_stack) {
      result_.findings.Add(Fault::kBarrier, first->waiting.place, waiting.place,
                           "invocation " + std::to_string(k) + " waits elsewhere");
    }
  }
  for (Invocation& invocation : invocations_) {
    invocation.waiting = {};
    invocation.fences_when_met = invocation.fences;
  }
  ++epoch_;
  ++result_.barrier_count;
}

WorkGroups::Region* WorkGroups::RegionOf(const uint32_t* word) {
  const auto is_in = [word](const Region& region) {
    return word >= region.words && word < region.words + region.word_count;
  };
  if (is_in(regions_[last_region_])) return &regions_[last_region_];
  const auto found = std::find_if(regions_.begin(), regions_.end(), is_in);
  if (found == regions_.end()) return nullptr;
  last_region_ = static_cast<size_t>(found - regions_.begin());
  return &*found;
}

Access WorkGroups::AccessAt(MemoryKind kind, const void* place) const {
  const uint32_t subgroup = current_ / kSubgroupSize;
  return {.group = group_,
          .invocation = current_,
          .subgroup = subgroup,
          .epoch = epoch_,
          .subgroup_epoch = subgroup_epochs_[subgroup],
          .fence = invocations_[current_].fences[static_cast<size_t>(kind)],
          .place = place};
}

std::string WorkGroups::Describe(const Region& region, size_t index) const {
  const size_t words = region.info.element_bytes / 4;
  std::string text = std::string(region.info.name) + "[" + std::to_string(index / words) + "]";
  if (words > 1) text += " word " + std::to_string(index % words);
  return text + " by invocation " + std::to_string(current_) + " of group " +
         std::to_string(group_);
}

// A write is seen after a barrier only if the writer passed a memory barrier before it; and by
// others than the writer only in coherent blocks.
void WorkGroups::CheckVisible(const Region& region, size_t index, const Access& reader) {
  const Access* write = region.log.LastWrite(index, reader);
  if (write == nullptr || !IsOrdered(*write, reader)) return;
  const bool is_in_subgroup =
      write->subgroup == reader.subgroup && write->subgroup_epoch < reader.subgroup_epoch;
  const auto kind = static_cast<size_t>(region.kind);
  const bool has_fence = invocations_[write->invocation].fences_when_met[kind] > write->fence;
  if (region.info.is_coherent != 0 && (has_fence || is_in_subgroup)) return;
  const char* why = region.info.is_coherent == 0 ? ": the block is not coherent"
                                                 : ": no memory barrier after the write";
  result_.findings.Add(Fault::kNotVisible, reader.place, write->place,
                       Describe(region, index) + why);
}

void WorkGroups::Watch(Region& region, const uint32_t* word, AccessKind kind, const void* place,
                       bool is_allowed) {
  ++result_.access_count;
  const auto index = static_cast<size_t>(word - region.words);
  const Access access = AccessAt(region.kind, place);
  if (kind != AccessKind::kWrite) {
    if (*word == kUnwritten && !(kind == AccessKind::kAtomic && is_allowed)) {
      result_.findings.Add(Fault::kUnwritten, place, nullptr, Describe(region, index));
    }
    CheckVisible(region, index, access);
  }
  if (kind != AccessKind::kRead && region.info.is_readonly != 0) {
    result_.findings.Add(Fault::kReadonly, place, nullptr, Describe(region, index));
  }
  const auto conflict = region.log.Add(index, kind, access, is_allowed);
  if (!conflict) return;
  result_.findings.Add(Fault::kRace, place, conflict->earlier.place,
                       Describe(region, index) + " and by invocation " +
                           std::to_string(conflict->earlier.invocation) + " of group " +
                           std::to_string(conflict->earlier.group));
}

uint32_t WorkGroups::Read(const uint32_t* word) {
  if (Region* region = RegionOf(word)) {
    Watch(*region, word, AccessKind::kRead, __builtin_return_address(0), false);
  }
  return *word;
}

void WorkGroups::Write(uint32_t* word, uint32_t value) {
  if (Region* region = RegionOf(word)) {
    Watch(*region, word, AccessKind::kWrite, __builtin_return_address(0), *word == value);
  }
  *word = value;
}

uint32_t WorkGroups::Change(uint32_t* word, AtomicKind kind, uint32_t value) {
  if (Region* region = RegionOf(word)) {
    // Bits of a word that are set one by one need not all be written.
    const bool is_of_bits = kind == AtomicKind::kOr || kind == AtomicKind::kAnd;
    Watch(*region, word, AccessKind::kAtomic, __builtin_return_address(0), is_of_bits);
  }
  const uint32_t before = *word;
  if (kind == AtomicKind::kOr) *word |= value;
  if (kind == AtomicKind::kAnd) *word &= value;
  if (kind == AtomicKind::kAdd) *word += value;
  if (kind == AtomicKind::kMax) *word = std::max(*word, value);
  if (kind == AtomicKind::kMin) *word = std::min(*word, value);
  return before;
}

void WorkGroups::ReportIndex(uint64_t index, uint64_t count) {
  result_.findings.Add(Fault::kOutOfBounds, __builtin_return_address(0), nullptr,
                       std::to_string(index) + " of " + std::to_string(count));
}

void WorkGroups::Barrier(BarrierKind kind, uint64_t call_stack) {
  using For = Waiting::For;
  WaitFor({.what = kind == BarrierKind::kGroup ? For::kGroup : For::kSubgroup,
           .call_stack = call_stack,
           .place = __builtin_return_address(0)});
}

void WorkGroups::MemoryBarrier(MemoryKind kind) {
  ++invocations_[current_].fences[static_cast<size_t>(kind)];
}

void WorkGroups::Shuffle(uint32_t* words, uint32_t count, uint32_t lane, uint64_t call_stack) {
  WaitFor({.what = Waiting::For::kShuffle,
           .call_stack = call_stack,
           .place = __builtin_return_address(0),
           .words = words,
           .count = count,
           .lane = lane});
}

}  // namespace drape::emulator
