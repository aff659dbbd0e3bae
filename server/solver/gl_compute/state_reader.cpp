#include "server/solver/gl_compute/state_reader.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <utility>

#include "server/core/check.h"
#include "shaders/interface/bindings.h"

namespace drape {

namespace {

constexpr uint64_t kPackedBytes = 16 * 1024 * 1024;
constexpr uint32_t kMaxItems = 16 * 1024;
// Words per item: long columns are cut so that several work groups share them.
constexpr uint32_t kPieceWords = 4096;
constexpr size_t kMinReadbackBytes = 64 * 1024;
// One on its way while another is read.
constexpr size_t kMaxSpareBuffers = 2;
constexpr uint64_t kReadsOfUnusedBuffer = 1000;  // then the buffer is freed

size_t WordCount(std::span<const StateColumn> columns, std::span<const ColumnRun> runs) {
  size_t words = 0;
  for (const StateColumn& column : columns) words += column.count;
  if (runs.empty()) return words;
  words = 0;
  for (const ColumnRun& run : runs) words += run.count;
  return columns.size() * words;
}

}  // namespace

std::vector<ColumnRun> RunsOf(std::span<const uint32_t> particles) {
  std::vector<ColumnRun> runs;
  for (const uint32_t particle : particles) {
    const uint32_t first = 3 * particle;
    if (runs.empty() || runs.back().first + runs.back().count != first) runs.push_back({first, 0});
    runs.back().count += 3;
  }
  return runs;
}

Result<StateReader> StateReader::Create(const gl::Program* pack, int64_t max_bytes,
                                        const DispatchLimits& limits) {
  Result<gl::Buffer> items = gl::Buffer::Create(kMaxItems * sizeof(shader::PackItem));
  if (!items.ok()) return items.status();
  Result<gl::Buffer> packed =
      gl::Buffer::Create(std::min(kPackedBytes, static_cast<uint64_t>(max_bytes)));
  if (!packed.ok()) return packed.status();
  return StateReader(pack, std::move(items).value(), std::move(packed).value(), max_bytes, limits);
}

StateTransfer StateReader::Begin(const gl::Buffer& states, std::span<const StateColumn> columns,
                                 std::span<const ColumnRun> runs) {
  const size_t word_count = WordCount(columns, runs);
  StateTransfer transfer(this, word_count);
  if (word_count == 0) return transfer;
  transfer.memory_ = Memory(word_count * sizeof(float));
  if (!transfer.memory_) transfer.words_.resize(word_count);
  const uint64_t round_words = packed_.size_bytes() / sizeof(float);
  std::vector<shader::PackItem> items;
  uint64_t words = 0;  // of this round
  uint64_t done = 0;   // of all rounds before
  const auto flush = [&] {
    // OpenGL does not keep a kernel from writing what a copy before it still reads.
    if (done > 0) DeviceBarrier();
    Pack(states, items);
    if (transfer.memory_) {
      transfer.memory_->CopyFrom(packed_, 0, done * sizeof(float), words * sizeof(float));
    } else {
      packed_.Download(0, std::as_writable_bytes(std::span(transfer.words_).subspan(done, words)));
    }
    done += words;
    words = 0;
    items.clear();
  };
  // Made item by item: a list for many cloths times many runs would be long.
  const auto add = [&](uint32_t begin, uint32_t end) {
    while (begin < end) {
      if (words == round_words || items.size() == kMaxItems) flush();
      const uint32_t count = static_cast<uint32_t>(
          std::min<uint64_t>({end - begin, kPieceWords, round_words - words}));
      items.push_back({begin, static_cast<uint32_t>(words), count, 0});
      words += count;
      begin += count;
    }
  };
  for (const StateColumn& column : columns) {
    if (runs.empty()) add(column.begin, column.begin + column.count);
    for (const ColumnRun& run : runs) {
      add(column.begin + run.first, column.begin + run.first + run.count);
    }
  }
  flush();
  if (transfer.memory_) transfer.fence_ = gl::Fence::Insert();
  return transfer;
}

void StateReader::Pack(const gl::Buffer& states, std::span<const shader::PackItem> items) {
  items_.Upload(0, std::as_bytes(items));
  items_.BindStorage(DRAPE_BINDING_ITEMS);
  states.BindStorage(DRAPE_BINDING_STATES);
  packed_.BindStorage(DRAPE_BINDING_PACKED);
  DispatchPerItem(*pack_, 0, static_cast<uint32_t>(items.size()), limits_);
}

std::optional<gl::ReadbackBuffer> StateReader::Memory(size_t size_bytes) {
  if (size_bytes > max_bytes_) return std::nullopt;
  const auto fitting = std::find_if(spare_.begin(), spare_.end(), [&](const Spare& spare) {
    return spare.memory.size_bytes() >= size_bytes;
  });
  if (fitting != spare_.end()) {
    std::optional<gl::ReadbackBuffer> memory = std::move(fitting->memory);
    spare_.erase(fitting);
    return memory;
  }
  const uint64_t with_slack = std::max(std::bit_ceil(size_bytes), kMinReadbackBytes);
  Result<gl::ReadbackBuffer> made =
      gl::ReadbackBuffer::Create(std::max<uint64_t>(std::min(with_slack, max_bytes_), size_bytes));
  if (!made.ok()) return std::nullopt;
  return std::move(made).value();
}

// Smallest first. Frees buffers that no read has taken for long, and the smallest if there are too
// many.
void StateReader::Return(gl::ReadbackBuffer memory) {
  ++read_count_;
  std::erase_if(spare_, [&](const Spare& spare) {
    return read_count_ - spare.last_read > kReadsOfUnusedBuffer;
  });
  spare_.push_back({std::move(memory), read_count_});
  std::sort(spare_.begin(), spare_.end(), [](const Spare& a, const Spare& b) {
    return a.memory.size_bytes() < b.memory.size_bytes();
  });
  if (spare_.size() > kMaxSpareBuffers) spare_.erase(spare_.begin());
}

void StateTransfer::Take(std::initializer_list<std::span<float>> parts) {
  size_t words = 0;
  for (const std::span<float> part : parts) words += part.size();
  DRAPE_CHECK(words == word_count_, "the parts must add up to the columns");
  if (words == 0) return;
  fence_.Wait();
  const auto* next = memory_ ? memory_->bytes() : std::as_bytes(std::span(words_)).data();
  for (const std::span<float> part : parts) {
    if (part.empty()) continue;
    std::memcpy(part.data(), next, part.size_bytes());
    next += part.size_bytes();
  }
  if (memory_) reader_->Return(*std::exchange(memory_, std::nullopt));
  words_.clear();
  word_count_ = 0;
}

}  // namespace drape
