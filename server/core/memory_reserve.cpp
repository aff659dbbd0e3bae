#include "server/core/memory_reserve.h"

#include <sys/mman.h>

#include <atomic>
#include <cstddef>
#include <utility>

namespace drape {
namespace {

// What a request may have of the reserve: enough for what is small, such as its own answer.
constexpr uint64_t kOfRequest_bytes = uint64_t{4} << 20;

thread_local int request_scopes = 0;
thread_local bool has_had_some = false;  // of the reserve, in this scope
// The heap keeps what is freed, so that the whole reserve may not come back for long: a part of it
// does, too, down to this one.
constexpr uint64_t kSmallestPart = 16;

// At its own beginning.
struct Block {
  uint64_t bytes;
};

std::atomic<uint64_t> whole_bytes{0};  // 0: none is kept
std::atomic<Block*> reserve{nullptr};  // null: given up
std::atomic<bool> is_whole{false};
std::atomic<uint64_t> times_given_up{0};

Block* Map(uint64_t bytes) {
  void* const block = mmap(nullptr, bytes, PROT_READ | PROT_WRITE,
                           MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  return block == MAP_FAILED ? nullptr : new (block) Block{bytes};
}

// Whether there was one.
bool Unmap(Block* block) {
  if (block == nullptr) return false;
  munmap(block, block->bytes);
  return true;
}

bool GiveUp() {
  is_whole = false;
  if (!Unmap(reserve.exchange(nullptr))) return false;
  ++times_given_up;
  return true;
}

// Whether there was as much.
bool GiveUpSome() {
  is_whole = false;
  Block* const block = reserve.exchange(nullptr);
  if (block == nullptr) return false;
  ++times_given_up;
  if (block->bytes <= 2 * kOfRequest_bytes) return Unmap(block);
  block->bytes -= kOfRequest_bytes;
  munmap(reinterpret_cast<std::byte*>(block) + block->bytes, kOfRequest_bytes);
  Block* none = nullptr;
  if (!reserve.compare_exchange_strong(none, block)) Unmap(block);
  return true;
}

// After a failed allocation; returns where it should be tried again.
void OnNoMemory() {
  const bool is_request = request_scopes > 0;
  const bool has_room = is_request ? !std::exchange(has_had_some, true) && GiveUpSome() : GiveUp();
  if (!has_room) throw std::bad_alloc();
}

}  // namespace

Status OutOfMemory() {
  return {StatusCode::kResourceExhausted, "DEVICE_MEMORY", "the memory has no room"};
}

void MemoryReserve::Keep(uint64_t bytes) {
  whole_bytes = bytes;
  (void)IsThere();
  std::set_new_handler(OnNoMemory);
}

bool MemoryReserve::IsThere() {
  if (whole_bytes == 0 || reserve != nullptr) return true;
  Block* block = nullptr;
  for (uint64_t part = 1; block == nullptr && part <= kSmallestPart; part *= 2) {
    block = Map(whole_bytes / part);
  }
  if (block == nullptr) return false;
  is_whole = block->bytes == whole_bytes;
  Block* none = nullptr;
  if (!reserve.compare_exchange_strong(none, block)) Unmap(block);
  return true;
}

bool MemoryReserve::Renew() {
  if (whole_bytes == 0 || is_whole) return true;
  Unmap(reserve.exchange(nullptr));
  return IsThere();
}

uint64_t MemoryReserve::times_used() {
  return times_given_up;
}

RequestMemoryScope::RequestMemoryScope() {
  if (request_scopes++ == 0) has_had_some = false;
}

RequestMemoryScope::~RequestMemoryScope() {
  --request_scopes;
}

}  // namespace drape
