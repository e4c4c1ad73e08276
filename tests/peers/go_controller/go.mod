module ringcontroller

go 1.19
