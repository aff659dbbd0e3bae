#include "tests/emulator/accesses.h"

namespace drape::emulator {

bool IsOrdered(const Access& earlier, const Access& later) {
  if (earlier.group != later.group) return false;
  if (earlier.invocation == later.invocation || earlier.epoch < later.epoch) return true;
  return earlier.subgroup == later.subgroup && earlier.subgroup_epoch < later.subgroup_epoch;
}

void AccessLog::Recent::Add(const Access& access) {
  if (here[0].exists() && here[0].group != access.group) {
    if (!elsewhere.exists()) elsewhere = here[0];
    here = {};
  }
  // The newest is first; the second is of another invocation, of another subgroup if there is one.
  const bool is_repeated = here[0].invocation == access.invocation ||
                           (here[1].exists() && here[0].subgroup == access.subgroup &&
                            here[1].subgroup != access.subgroup && here[1].epoch == here[0].epoch);
  if (here[0].exists() && !is_repeated) here[1] = here[0];
  here[0] = access;
}

const Access* AccessLog::Recent::Unordered(const Access& later) const {
  if (elsewhere.exists() && elsewhere.group != later.group) return &elsewhere;
  for (const Access& access : here) {
    if (access.exists() && !IsOrdered(access, later)) return &access;
  }
  return nullptr;
}

AccessLog::AccessLog(size_t word_count) : pages_((word_count + kPage - 1) / kPage) {}

AccessLog::Word& AccessLog::WordAt(size_t word) {
  std::unique_ptr<Page>& page = pages_[word / kPage];
  if (!page) page = std::make_unique<Page>();
  return (*page)[word % kPage];
}

std::optional<AccessLog::Conflict> AccessLog::Add(size_t word, AccessKind kind,
                                                  const Access& access, bool keeps_value) {
  Word& accesses = WordAt(word);
  std::optional<Conflict> conflict;
  for (const AccessKind other : {AccessKind::kRead, AccessKind::kWrite, AccessKind::kAtomic}) {
    if (other == kind && (kind != AccessKind::kWrite || keeps_value)) continue;
    const Access* earlier = accesses[static_cast<size_t>(other)].Unordered(access);
    if (earlier != nullptr && !conflict) conflict = Conflict{*earlier, other};
  }
  accesses[static_cast<size_t>(kind)].Add(access);
  return conflict;
}

const Access* AccessLog::LastWrite(size_t word, const Access& reader) const {
  const std::unique_ptr<Page>& page = pages_[word / kPage];
  if (!page) return nullptr;
  const Access* last = nullptr;
  for (const AccessKind kind : {AccessKind::kWrite, AccessKind::kAtomic}) {
    const Access& access = (*page)[word % kPage][static_cast<size_t>(kind)].here[0];
    if (!access.exists() || access.group != reader.group) continue;
    if (last == nullptr || access.epoch >= last->epoch) last = &access;
  }
  return last != nullptr && last->invocation != reader.invocation ? last : nullptr;
}

}  // namespace drape::emulator
