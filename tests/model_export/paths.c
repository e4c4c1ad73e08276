/* paths WINDOWS URI...: prints the file that each URI of a folder names. */
#include "bufferstand_spring_resource.h"

int main(int count, char **argument)
{
    bs_resource unused;
    int k;
    unused.cells = NULL;
    (void)bs_open_, (void)bs_read_;
    for (k = 2; k < count; ++k) {
        char *path = bs_path_of(argument[k], "f", argument[1][0] == '1');
        puts(path);
        free(path);
    }
    bs_release(&unused);
    return 0;
}
