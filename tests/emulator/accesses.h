// Which accesses to memory race: two of one word by two invocations, one of them a write, that no
// barrier orders. Pure.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

namespace drape::emulator {

// When and by whom a word was accessed. Barriers of a work group end an epoch; those of a subgroup
// end one of its own.
struct Access {
  uint32_t group = 0;
  uint32_t invocation = 0;
  uint32_t subgroup = 0;
  uint32_t epoch = 0;
  uint32_t subgroup_epoch = 0;
  uint32_t fence = 0;  // memory barriers that the invocation had passed
  const void* place = nullptr;

  bool exists() const { return place != nullptr; }
};

// Whether `earlier` happens before `later`, which the emulator ran after it.
bool IsOrdered(const Access& earlier, const Access& later);

enum class AccessKind : uint8_t { kRead, kWrite, kAtomic };

// Of each word of a block the last accesses of each kind. Two are kept, by different invocations
// where possible, so that an access by the invocation itself hides none of another one.
class AccessLog {
 public:
  explicit AccessLog(size_t word_count);

  struct Conflict {
    Access earlier;
    AccessKind kind = AccessKind::kRead;
  };
  // Remembers the access; the earlier one that it races with, if any. `keeps_value`: a write of the
  // value that the word has, which may meet another such write.
  std::optional<Conflict> Add(size_t word, AccessKind kind, const Access& access,
                              bool keeps_value = false);
  // The last write of the word by another invocation than this one of the group.
  const Access* LastWrite(size_t word, const Access& reader) const;

 private:
  // Two accesses of a kind in the present group, and the first of an earlier one.
  struct Recent {
    std::array<Access, 2> here;
    Access elsewhere;

    void Add(const Access& access);
    const Access* Unordered(const Access& later) const;
  };
  using Word = std::array<Recent, 3>;  // by AccessKind
  static constexpr size_t kPage = 256;
  using Page = std::array<Word, kPage>;

  Word& WordAt(size_t word);

  std::vector<std::unique_ptr<Page>> pages_;
};

}  // namespace drape::emulator
