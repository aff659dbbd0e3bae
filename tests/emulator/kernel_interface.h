// What a translated kernel and the emulator know of each other.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace drape::emulator {

enum class AtomicKind : uint8_t { kOr, kAnd, kAdd, kMax, kMin };
// Of the invocations of a work group, or of a subgroup of 32.
enum class BarrierKind : uint8_t { kGroup, kSubgroup };
enum class MemoryKind : uint8_t { kShared, kStorage };

inline constexpr uint32_t kSubgroupSize = 32;
// What fills memory that nothing has written: a NaN that no arithmetic makes.
inline constexpr uint32_t kUnwritten = 0xffc0dead;

struct Ids {
  uint32_t local = 0;
  uint32_t local_size = 0;
  uint32_t group[3] = {};
  uint32_t group_count[3] = {};
};

// Roots and quotients off by -1 to +2 units in the last place; which one depends on the operands
// and the seed.
struct Arithmetic {
  bool is_inexact = false;
  uint32_t seed = 0;
};

// Called by the invocation that runs. The return address tells where.
class Machine {
 public:
  virtual ~Machine() = default;
  virtual uint32_t Read(const uint32_t* word) = 0;
  virtual void Write(uint32_t* word, uint32_t value) = 0;
  virtual uint32_t Change(uint32_t* word, AtomicKind kind, uint32_t value) = 0;
  virtual void ReportIndex(uint64_t index, uint64_t count) = 0;
  // `call_stack`: a hash of the calls that led here.
  virtual void Barrier(BarrierKind kind, uint64_t call_stack) = 0;
  virtual void MemoryBarrier(MemoryKind kind) = 0;
  virtual void Shuffle(uint32_t* words, uint32_t count, uint32_t lane, uint64_t call_stack) = 0;

  // Of the invocation that runs: where its frames begin.
  void* first_frame = nullptr;
};

// An array of the kernel: elements at an address that the emulator sets.
struct AnyBlock {
  std::byte* bytes = nullptr;
  uint32_t count = 0;
};

struct BlockInfo {
  uint32_t binding = 0;
  const char* name = "";
  int is_coherent = 0;
  int is_readonly = 0;
  size_t element_bytes = 0;
  AnyBlock* block = nullptr;
  uint32_t count = 0;  // of shared memory
};

struct UniformInfo {
  uint32_t location = 0;
  uint32_t* value = nullptr;
};

// What the shared library of a kernel exports as `drape_emulated_kernel`.
struct KernelEntry {
  void (*set_up)(Machine* machine, const Arithmetic* arithmetic, uint32_t local_size);
  // After set_up: sizes of shared memory depend on the local size.
  void (*describe)(std::vector<BlockInfo>& blocks, std::vector<BlockInfo>& shared,
                   std::vector<UniformInfo>& uniforms);
  void (*run)(const Ids& ids);
};

}  // namespace drape::emulator
