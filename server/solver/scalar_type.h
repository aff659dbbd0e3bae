// The floating-point type in which a backend keeps the states of its cloths.
#pragma once

namespace drape {

enum class ScalarType { kFloat32, kFloat64 };

}  // namespace drape
