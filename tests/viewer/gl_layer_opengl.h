// What the layer of gl_layer.c needs of OpenGL: the context of the application, and one of its own that shares with it.
//
// Everything is looked up in the libraries that the application has loaded, so no headers of OpenGL are needed.
#define _GNU_SOURCE
#define CL_TARGET_OPENCL_VERSION 300
#include <CL/cl.h>
#include <CL/cl_icd.h>
#include <CL/cl_layer.h>
#include <dlfcn.h>
#include <pthread.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define API CL_API_CALL
static const struct _cl_icd_dispatch *next;
static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;

static cl_int mistake(cl_int status, const char *text, ...) {
  const char *name = getenv("GL_LAYER_LOG");
  FILE *file = name ? fopen(name, "a") : NULL;
  va_list arguments;
  va_start(arguments, text);
  vfprintf(file ? file : stderr, text, arguments);
  va_end(arguments);
  fputc('\n', file ? file : stderr);
  if (file) fclose(file);
  return status;
}

typedef unsigned GLenum, GLuint;
typedef int GLint;
enum {
  GL_TEXTURE_2D = 0x0DE1, GL_RGBA = 0x1908, GL_RGBA8 = 0x8058, GL_UNSIGNED_BYTE = 0x1401, GL_TEXTURE_WIDTH = 0x1000,
  GL_TEXTURE_HEIGHT = 0x1001, GL_TEXTURE_INTERNAL_FORMAT = 0x1003, GL_TEXTURE_MIN_FILTER = 0x2801, GL_LINEAR = 0x2601,
  GL_TEXTURE_MAX_LEVEL = 0x813D, GL_WAIT_FAILED = 0x911D, GL_TIMEOUT_EXPIRED = 0x911B
};
static struct {
  void (*BindTexture)(GLenum, GLuint);
  void (*GetTexLevelParameteriv)(GLenum, GLint, GLenum, GLint *);
  void (*GetTexParameteriv)(GLenum, GLenum, GLint *);
  void (*GetTexImage)(GLenum, GLint, GLenum, GLenum, void *);
  void (*TexSubImage2D)(GLenum, GLint, GLint, GLint, GLint, GLint, GLenum, GLenum, const void *);
  unsigned char (*IsTexture)(GLuint);
  unsigned char (*IsSync)(void *);
  GLenum (*ClientWaitSync)(void *, unsigned, unsigned long long);
  void (*Finish)(void);
  GLenum (*GetError)(void);
} gl;
static struct {
  void *(*GetCurrentContext)(void), *(*GetCurrentDisplay)(void);
  unsigned long (*GetCurrentDrawable)(void), (*GetCurrentReadDrawable)(void);
  int (*MakeContextCurrent)(void *, unsigned long, unsigned long, void *), (*QueryContext)(void *, void *, int, int *);
  void **(*ChooseFBConfig)(void *, int, const int *, int *), *(*CreateContextAttribsARB)(void *, void *, void *, int, const int *);
  void *(*GetProcAddress)(const char *);
} glx;
static struct {
  void *(*GetCurrentContext)(void), *(*GetCurrentDisplay)(void), *(*GetCurrentSurface)(int);
  unsigned (*BindAPI)(unsigned), (*QueryAPI)(void), (*MakeCurrent)(void *, void *, void *, void *);
  unsigned (*QueryContext)(void *, void *, int, int *), (*ChooseConfig)(void *, const int *, void **, int, int *);
  void *(*CreateContext)(void *, void *, void *, const int *), *(*GetProcAddress)(const char *);
} egl;

#define FROM(library, api, prefix, name) (*(void **)&api.name = dlsym(library, prefix #name))
static void find_platforms(void) {
  void *library = dlopen("libGLX.so.0", RTLD_NOW | RTLD_NOLOAD);
  if (!library) library = dlopen("libGL.so.1", RTLD_NOW | RTLD_NOLOAD);
  if (library && !glx.GetCurrentContext) {
    FROM(library, glx, "glX", GetCurrentDisplay), FROM(library, glx, "glX", GetCurrentDrawable);
    FROM(library, glx, "glX", GetCurrentReadDrawable), FROM(library, glx, "glX", MakeContextCurrent);
    FROM(library, glx, "glX", QueryContext), FROM(library, glx, "glX", ChooseFBConfig);
    FROM(library, glx, "glX", GetProcAddress), FROM(library, glx, "glX", GetCurrentContext);
    *(void **)&glx.CreateContextAttribsARB = glx.GetProcAddress("glXCreateContextAttribsARB");
  }
  library = dlopen("libEGL.so.1", RTLD_NOW | RTLD_NOLOAD);
  if (library && !egl.GetCurrentContext) {
    FROM(library, egl, "egl", GetCurrentDisplay), FROM(library, egl, "egl", GetCurrentSurface);
    FROM(library, egl, "egl", BindAPI), FROM(library, egl, "egl", QueryAPI), FROM(library, egl, "egl", MakeCurrent);
    FROM(library, egl, "egl", QueryContext), FROM(library, egl, "egl", ChooseConfig);
    FROM(library, egl, "egl", CreateContext), FROM(library, egl, "egl", GetProcAddress);
    FROM(library, egl, "egl", GetCurrentContext);
  }
}

#define CALL(name) (*(void **)&gl.name = address("gl" #name))
static void find_calls(void *(*address)(const char *)) {
  CALL(BindTexture), CALL(GetTexLevelParameteriv), CALL(GetTexParameteriv), CALL(GetTexImage), CALL(TexSubImage2D);
  CALL(IsTexture), CALL(IsSync), CALL(ClientWaitSync), CALL(Finish), CALL(GetError);
}

// An OpenCL context that shares: the application's OpenGL context and ours beside it.
struct sharing {
  cl_context context;
  int is_egl;
  void *display, *theirs, *ours;
  struct sharing *rest;
};
static struct sharing *sharings;

static int make_ours(struct sharing *one) {
  int id = 0, count = 0, screen = 0;
  if (one->is_egl) {
    egl.QueryContext(one->display, one->theirs, 0x3028, &id);
    const int wanted[] = {0x3028, id, 0x3038}, version[] = {0x3098, 3, 0x30FB, 3, 0x30FD, 1, 0x3038};
    void *config = NULL;
    egl.ChooseConfig(one->display, wanted, &config, 1, &count);
    if (count) one->ours = egl.CreateContext(one->display, config, one->theirs, version);
    find_calls(egl.GetProcAddress);
  } else {
    glx.QueryContext(one->display, one->theirs, 0x8013, &id);
    glx.QueryContext(one->display, one->theirs, 0x800C, &screen);
    const int wanted[] = {0x8013, id, 0}, version[] = {0x2091, 3, 0x2092, 3, 0x9126, 1, 0};
    void **configs = glx.ChooseFBConfig(one->display, screen, wanted, &count);
    if (count) one->ours = glx.CreateContextAttribsARB(one->display, configs[0], one->theirs, 1, version);
    find_calls(glx.GetProcAddress);
  }
  return one->ours != NULL;
}

struct before { void *context, *display, *draw, *read; unsigned api; };

static struct before enter(const struct sharing *one) {
  struct before was;
  if (one->is_egl) {
    was.api = egl.QueryAPI();
    egl.BindAPI(0x30A2);
    was.context = egl.GetCurrentContext(), was.display = egl.GetCurrentDisplay();
    was.draw = egl.GetCurrentSurface(0x3059), was.read = egl.GetCurrentSurface(0x305A);
    if (!egl.MakeCurrent(one->display, NULL, NULL, one->ours)) mistake(0, "the layer cannot make its context current");
  } else {
    was.context = glx.GetCurrentContext(), was.display = glx.GetCurrentDisplay();
    was.draw = (void *)glx.GetCurrentDrawable(), was.read = (void *)glx.GetCurrentReadDrawable();
    if (!glx.MakeContextCurrent(one->display, 0, 0, one->ours)) mistake(0, "the layer cannot make its context current");
  }
  return was;
}

static void leave(const struct sharing *one, struct before was) {
  gl.Finish();
  if (gl.GetError()) mistake(0, "the layer's own OpenGL calls failed");
  if (one->is_egl) {
    egl.MakeCurrent(one->display, was.draw, was.read, was.context);
    egl.BindAPI(was.api);
  } else {
    glx.MakeContextCurrent(was.display ? was.display : one->display, (unsigned long)was.draw, (unsigned long)was.read, was.context);
  }
}
