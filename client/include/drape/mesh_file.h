// Triangle meshes from Wavefront OBJ files.
#pragma once

#include <filesystem>

#include "drape/error.h"
#include "drape/v1/cloth_spec.pb.h"

namespace drape {
inline namespace client {

// Reads `v` and `f` of every object in the file as one mesh: vertices by position index alone
// (vertices that differ only in texture coordinate or normal are one), polygons split as fans,
// coordinates times `scale_m` [metres per unit of the file], in double precision. Thread-safe.
// Throws kNotFound without the file, kInvalidArgument when it is no OBJ, has no faces, or a face
// names a missing vertex. Degenerate triangles are left to the server, which drops and counts them.
v1::Mesh LoadMesh(const std::filesystem::path& path, double scale_m = 1);

}  // namespace client
}  // namespace drape
