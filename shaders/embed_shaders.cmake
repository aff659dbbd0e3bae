# cmake -DSHADER_DIR=... -DFILES="a;b" -DOUTPUT=x.cpp -P embed_shaders.cmake
# Writes one .cpp with the text of every file as a raw string (shaders/embedded_shaders.h).
set(text "// Made by shaders/embed_shaders.cmake.\n#include \"shaders/embedded_shaders.h\"\n\n")
string(APPEND text "namespace drape {\n\nstd::span<const EmbeddedShader> EmbeddedShaders() {\n")
string(APPEND text "  static constexpr EmbeddedShader kShaders[] = {\n")
foreach(file IN LISTS FILES)
  file(READ "${SHADER_DIR}/${file}" source)
  string(APPEND text "      {\"${file}\", R\"GLSLTEXT(${source})GLSLTEXT\"},\n")
endforeach()
string(APPEND text "  };\n  return kShaders;\n}\n\n}  // namespace drape\n")
file(WRITE "${OUTPUT}" "${text}")
