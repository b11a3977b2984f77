// Columns in files: how they lie there, and what is refused.
#include "tracer/column_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>

#include "host/error.hpp"
#include "host/io/files.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;
using namespace std::string_literals;
using testing::ElementsAre;
using testing::HasSubstr;

struct ColumnFiles : testing::Test {
  void SetUp() override {
    std::string name = (fs::temp_directory_path() / "clerestory-columns-XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    folder = name;
  }
  void TearDown() override { fs::remove_all(folder); }

  fs::path file_of(const std::string& columns) const {
    write_file(folder / "columns", packed_columns(columns));
    return folder / "columns";
  }
  std::string error_of(const std::string& columns, auto read) const {
    try {
      ColumnReader from(file_of(columns));
      read(from);
    } catch (const Error& e) {
      EXPECT_EQ(e.kind(), ErrorKind::Usage);
      EXPECT_THAT(e.what(), HasSubstr((folder / "columns").string()));
      return e.what();
    }
    return "";
  }
  fs::path folder;
};

TEST_F(ColumnFiles, AreReadAsTheyWereWritten) {
  ColumnWriter to;
  to.column(std::vector<std::int32_t>{1, -2});
  to.names({"wall", ""});
  to.column(std::vector<double>{});
  // Counts, and of the numbers the lowest bytes first.
  EXPECT_EQ(to.columns(),
            "\2\0\0\0\0\0\0\0"
            "\1\xfe"
            "\0\xff"
            "\0\xff"
            "\0\xff"
            "\6\0\0\0\0\0\0\0"
            "wall\n\n"
            "\0\0\0\0\0\0\0\0"s);
  ColumnReader from(file_of(to.columns()));
  EXPECT_THAT(from.column<std::int32_t>("whole", 2), ElementsAre(1, -2));
  EXPECT_THAT(from.names("names"), ElementsAre("wall", ""));
  EXPECT_THAT(from.column<double>("none"), ElementsAre());
  from.end();
}

TEST_F(ColumnFiles, SayWhatIsWrong) {
  ColumnWriter to;
  to.column(std::vector<float>{1, 2});
  const std::string right = to.columns();
  EXPECT_EQ(error_of(right, [](ColumnReader& from) { from.column<float>("x", 2), from.end(); }), "");
  EXPECT_THAT(error_of(right, [](ColumnReader& from) { from.column<float>("x", 3); }), HasSubstr("x: 2"));
  EXPECT_THAT(error_of(right, [](ColumnReader& from) { from.column<double>("x"); }), HasSubstr("longer than the file"));
  EXPECT_THAT(error_of(right, [](ColumnReader& from) { from.end(); }), HasSubstr("16 bytes"));
  EXPECT_THAT(error_of("", [](ColumnReader& from) { from.names("x"); }), HasSubstr("missing"));
  ColumnWriter inf;
  inf.column(std::vector<double>{1, 1e308 * 10});
  EXPECT_THAT(error_of(inf.columns(), [](ColumnReader& from) { from.column<double>("x"); }), HasSubstr("not finite"));
  EXPECT_THAT(error_of("\1\0\0\0\0\0\0\0a"s, [](ColumnReader& from) { from.names("x"); }), HasSubstr("no lines"));
}

TEST_F(ColumnFiles, NoMoreIsWrittenThanIsRead) {
  EXPECT_THROW(packed_columns(std::string((1 << 28) + 1, '\0')), Error);
}

// A stream may claim what deflate cannot pack, and memory is not taken for it.
TEST_F(ColumnFiles, ClaimsAreBounded) {
  std::string bytes = packed_columns(std::string(1000, 'a'));
  bytes.resize(bytes.size() - "\nhash 0123456789abcdef\n"s.size());
  bytes[sizeof "clerestory rooms\n" - 1 + 5] = 1;  // 2^40 bytes more
  write_file(
      folder / "columns", bytes + "\nhash " + [&] {
        write_file(folder / "hashed", bytes);
        return file_hash(folder / "hashed");
      }() + "\n");
  try {
    ColumnReader from(folder / "columns");
    ADD_FAILURE();
  } catch (const Error& e) {
    EXPECT_THAT(e.what(), HasSubstr("claims more"));
  }
}

}  // namespace
}  // namespace clerestory
