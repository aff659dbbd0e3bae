// The cloths of a snapshot.
#pragma once

#include <cstdint>
#include <map>
#include <string>

namespace drape::test {

// By id: the bytes of the ClothSnapshot, with the hash of its model as its id, and without what was
// measured by a clock or only says what the backend knows. Throws if
// the bytes are no snapshot.
std::map<uint64_t, std::string> WholesIn(const std::string& snapshot);
// In words: what differs between two of them.
std::string DifferenceOf(const std::string& whole, const std::string& other);

}  // namespace drape::test
