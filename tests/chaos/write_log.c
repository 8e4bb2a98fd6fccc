/* Writes down every write, sync, truncation and deletion of the books of a cell, as unsynced_writes.py reads it.
 *
 * To be preloaded. UNSYNCED_LOG names the folder; each process appends to a file of its own there.
 * A record: time (ns since the epoch), offset, length of the data, kind, length of the name; then name and data.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <fcntl.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/uio.h>
#include <time.h>
#include <unistd.h>

enum { WRITE = 1, SYNC = 2, TRUNCATE = 3, DELETE = 4 };

struct record {
  uint64_t time_ns;
  uint64_t offset;
  uint32_t length;
  uint16_t kind;
  uint16_t name_length;
} __attribute__((packed));

/* The name of a book behind a descriptor; its length, 0 for any other file. */
static ssize_t book(int fd, char *name, size_t size) {
  char link[64];
  snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
  ssize_t length = readlink(link, name, size - 1);
  if (length <= 0) return 0;
  name[length] = 0;
  char *end = strstr(name, ".sqlite");
  if (end == NULL || strstr(end, "-shm") != NULL) return 0;
  return length;
}

static void note(int kind, const char *name, size_t name_length, off_t offset, const void *data,
                 size_t length) {
  static int log = -1;
  static pid_t owner;
  static ssize_t (*real_writev)(int, const struct iovec *, int);
  if (log < 0 || owner != getpid()) {
    const char *folder = getenv("UNSYNCED_LOG");
    char path[4096];
    if (folder == NULL) return;
    owner = getpid();
    snprintf(path, sizeof path, "%s/%d.log", folder, (int)owner);
    log = open(path, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600);
    real_writev = dlsym(RTLD_NEXT, "writev");
  }
  struct timespec now;
  clock_gettime(CLOCK_REALTIME, &now);
  struct record record = {now.tv_sec * 1000000000ull + now.tv_nsec, offset, length, kind,
                          name_length};
  struct iovec parts[] = {{&record, sizeof record},
                          {(void *)name, name_length},
                          {(void *)data, length}};
  if (real_writev(log, parts, 3) < 0) abort();
}

#define REAL(name) \
  static __typeof__(name) *real; \
  if (real == NULL) real = (__typeof__(name) *)dlsym(RTLD_NEXT, #name)

ssize_t write(int fd, const void *data, size_t length) {
  REAL(write);
  char name[4096];
  ssize_t name_length = book(fd, name, sizeof name);
  if (name_length) note(WRITE, name, name_length, lseek(fd, 0, SEEK_CUR), data, length);
  return real(fd, data, length);
}

ssize_t pwrite(int fd, const void *data, size_t length, off_t offset) {
  REAL(pwrite);
  char name[4096];
  ssize_t name_length = book(fd, name, sizeof name);
  if (name_length) note(WRITE, name, name_length, offset, data, length);
  return real(fd, data, length, offset);
}

ssize_t pwrite64(int fd, const void *data, size_t length, off64_t offset) {
  REAL(pwrite64);
  char name[4096];
  ssize_t name_length = book(fd, name, sizeof name);
  if (name_length) note(WRITE, name, name_length, offset, data, length);
  return real(fd, data, length, offset);
}

static int synced(int fd, int result) {
  char name[4096];
  ssize_t name_length = result == 0 ? book(fd, name, sizeof name) : 0;
  if (name_length) note(SYNC, name, name_length, 0, "", 0);
  return result;
}

int fsync(int fd) {
  REAL(fsync);
  return synced(fd, real(fd));
}

int fdatasync(int fd) {
  REAL(fdatasync);
  return synced(fd, real(fd));
}

static void shortened(int fd, off_t length) {
  char name[4096];
  ssize_t name_length = book(fd, name, sizeof name);
  if (name_length) note(TRUNCATE, name, name_length, length, "", 0);
}

int ftruncate(int fd, off_t length) {
  REAL(ftruncate);
  shortened(fd, length);
  return real(fd, length);
}

int ftruncate64(int fd, off64_t length) {
  REAL(ftruncate64);
  shortened(fd, length);
  return real(fd, length);
}

int unlink(const char *path) {
  REAL(unlink);
  if (strstr(path, ".sqlite") != NULL && strstr(path, "-shm") == NULL)
    note(DELETE, path, strlen(path), 0, "", 0);
  return real(path);
}
