// A CSV file that is written row by row: an interrupted run keeps the rows it has.
#pragma once

#include <concepts>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

namespace drape::bench {

// One value as text: numbers with 6 significant digits.
class Cell {
 public:
  Cell(std::string text) : text_(std::move(text)) {}
  Cell(const char* text) : text_(text) {}
  Cell(double value);
  Cell(std::integral auto value) : text_(std::to_string(value)) {}

  const std::string& text() const { return text_; }

 private:
  std::string text_;
};

class Table {
 public:
  // Replaces the file. std::runtime_error if it cannot be written, also from Add. Texts must have
  // neither commas nor quotes.
  Table(const std::filesystem::path& path, const std::vector<std::string>& columns);

  // One cell per column; on disk when this returns.
  void Add(const std::vector<Cell>& cells);

 private:
  std::filesystem::path path_;
  size_t column_count_;
  std::ofstream file_;
};

}  // namespace drape::bench
