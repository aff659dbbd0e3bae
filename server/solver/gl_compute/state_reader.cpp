#include "server/solver/gl_compute/state_reader.h"

#include <algorithm>
#include <vector>

#include "shaders/interface/bindings.h"

namespace drape {

namespace {

constexpr uint64_t kPackedBytes = 16 * 1024 * 1024;
constexpr uint32_t kMaxItems = 16 * 1024;
// Words per item: long columns are cut so that several work groups share them.
constexpr uint32_t kPieceWords = 4096;

}  // namespace

Result<StateReader> StateReader::Create(const gl::Program* pack, int64_t max_bytes,
                                        const DispatchLimits& limits) {
  Result<gl::Buffer> items = gl::Buffer::Create(kMaxItems * sizeof(shader::PackItem));
  if (!items.ok()) return items.status();
  Result<gl::Buffer> packed =
      gl::Buffer::Create(std::min(kPackedBytes, static_cast<uint64_t>(max_bytes)));
  if (!packed.ok()) return packed.status();
  return StateReader(pack, std::move(items).value(), std::move(packed).value(), limits);
}

void StateReader::Read(const gl::Buffer& states, std::span<const StateColumn> columns,
                       std::span<float> packed) {
  const uint64_t round_words = packed_.size_bytes() / sizeof(float);
  std::vector<shader::PackItem> items;
  uint64_t words = 0;  // of this round
  uint64_t done = 0;   // of all rounds before
  const auto flush = [&] {
    Transfer(states, items, packed.subspan(done, words));
    done += words;
    words = 0;
    items.clear();
  };
  for (const StateColumn& column : columns) {
    for (uint32_t first = 0; first < column.count;) {
      if (words == round_words || items.size() == kMaxItems) flush();
      const uint32_t count = static_cast<uint32_t>(
          std::min<uint64_t>({column.count - first, kPieceWords, round_words - words}));
      items.push_back({column.begin + first, static_cast<uint32_t>(words), count, 0});
      words += count;
      first += count;
    }
  }
  flush();
}

void StateReader::Transfer(const gl::Buffer& states, std::span<const shader::PackItem> items,
                           std::span<float> packed) {
  if (items.empty()) return;
  items_.Upload(0, std::as_bytes(items));
  items_.BindStorage(DRAPE_BINDING_ITEMS);
  states.BindStorage(DRAPE_BINDING_STATES);
  packed_.BindStorage(DRAPE_BINDING_PACKED);
  DispatchPerItem(*pack_, 0, static_cast<uint32_t>(items.size()), limits_);
  packed_.Download(0, std::as_writable_bytes(packed));
}

}  // namespace drape
