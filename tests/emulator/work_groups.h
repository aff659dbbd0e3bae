// Runs a translated kernel as a GPU may: the invocations between two barriers in random order, the
// work groups of a dispatch too, shared memory full of garbage; and watches every access to memory.
#pragma once

#include <array>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "tests/emulator/accesses.h"
#include "tests/emulator/fibers.h"
#include "tests/emulator/findings.h"
#include "tests/emulator/kernel_interface.h"

namespace drape::emulator {

inline constexpr uint32_t kBindings = 8;
inline constexpr uint32_t kUniforms = 16;

// The contents of the storage blocks by binding; empty: nothing is bound.
using Blocks = std::array<std::vector<uint32_t>, kBindings>;

struct Dispatch {
  std::array<uint32_t, 3> group_count{1, 1, 1};
  std::array<uint32_t, kUniforms> uniforms{};  // by location
  Blocks blocks;
};

struct RunOptions {
  uint32_t local_size = 32;
  uint32_t seed = 1;  // of the orders
  Arithmetic arithmetic{};
};

struct RunResult {
  Blocks blocks;
  Findings findings;
  uint64_t barrier_count = 0;  // of work groups
  uint64_t access_count = 0;
};

class WorkGroups final : public Machine {
 public:
  static constexpr uint32_t kMostInvocations = 1024;

  WorkGroups() : fibers_(kMostInvocations) {}

  RunResult Run(const KernelEntry& kernel, const Dispatch& dispatch, const RunOptions& options);

  // Machine, for the kernel.
  uint32_t Read(const uint32_t* word) override;
  void Write(uint32_t* word, uint32_t value) override;
  uint32_t Change(uint32_t* word, AtomicKind kind, uint32_t value) override;
  void ReportIndex(uint64_t index, uint64_t count) override;
  void Barrier(BarrierKind kind, uint64_t call_stack) override;
  void MemoryBarrier(MemoryKind kind) override;
  void Shuffle(uint32_t* words, uint32_t count, uint32_t lane, uint64_t call_stack) override;

 private:
  // A block of the kernel, and what was accessed in it.
  struct Region {
    BlockInfo info;
    MemoryKind kind = MemoryKind::kStorage;
    uint32_t* words = nullptr;
    size_t word_count = 0;
    AccessLog log{0};
  };
  struct Waiting {
    enum class For : uint8_t { kNothing, kGroup, kSubgroup, kShuffle };
    For what = For::kNothing;
    uint64_t call_stack = 0;
    const void* place = nullptr;
    uint32_t* words = nullptr;
    uint32_t count = 0;
    uint32_t lane = 0;
  };
  struct Invocation {
    Waiting waiting;
    void* first_frame = nullptr;
    // Memory barriers passed, and those when the work group last met, by MemoryKind.
    std::array<uint32_t, 2> fences{};
    std::array<uint32_t, 2> fences_when_met{};
  };

  void OpenRegions(const KernelEntry& kernel, const Dispatch& dispatch, const RunOptions& options);
  void RunGroup(const KernelEntry& kernel, const std::array<uint32_t, 3>& group);
  void RunReady();
  void Release();
  bool ReleaseSubgroup(uint32_t first, uint32_t end);
  void ReleaseGroup();
  void Exchange(const std::vector<uint32_t>& members, uint32_t first);
  void WaitFor(const Waiting& waiting);

  Region* RegionOf(const uint32_t* word);
  Access AccessAt(MemoryKind kind, const void* place) const;
  // `is_allowed`: a write of the value that the word has; an atomic change of bits, which may be of
  // a word that nothing has written.
  void Watch(Region& region, const uint32_t* word, AccessKind kind, const void* place,
             bool is_allowed);
  void CheckVisible(const Region& region, size_t index, const Access& reader);
  std::string Describe(const Region& region, size_t index) const;

  Fibers fibers_;
  std::mt19937 random_;
  Arithmetic arithmetic_;
  uint32_t local_size_ = 0;
  std::array<uint32_t, 3> group_count_{};
  std::vector<Region> regions_;
  size_t last_region_ = 0;
  std::vector<uint32_t> shared_;
  std::vector<Invocation> invocations_;
  std::vector<uint32_t> subgroup_epochs_;
  uint32_t current_ = 0;  // invocation
  uint32_t group_ = 0;
  uint32_t epoch_ = 0;
  RunResult result_;
};

}  // namespace drape::emulator
